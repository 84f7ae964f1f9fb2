#include "worker/light/environment.h"

#include <cmath>

namespace bakewell {
namespace {

// Unit square to sphere: rows are polar angle from +Y, columns azimuth from +X towards +Z.
Vec3f DirectionOf(float u, float v) {
  const float theta = v * kPiF, phi = u * 2 * kPiF;
  const float s = std::sin(theta);
  return {s * std::cos(phi), std::cos(theta), s * std::sin(phi)};
}

}  // namespace

EnvironmentLight::EnvironmentLight(const Environment& environment) : environment_(environment) {
  const bool map = environment.type == EnvironmentType::kLatLong;
  const int w = map ? environment.width : 64, h = map ? environment.height : 32;
  std::vector<float> weights(static_cast<size_t>(w) * static_cast<size_t>(h));
  Vec3d fluence;
  table_ = Distribution2D(w, h, weights);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Rgb radiance = Radiance(CellCenter(x, y));
      weights[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)] =
          (Luminance(radiance) + MaxComponent(radiance) * 1e-3f) * CellSolidAngle(y);
      fluence += ToDouble(radiance) * static_cast<double>(CellSolidAngle(y));
    }
  }
  table_ = Distribution2D(w, h, weights);
  fluence_ = ToFloat(fluence);
  bright_ = MaxComponent(fluence_) > 0;
}

Vec3f EnvironmentLight::CellCenter(int x, int y) const {
  return DirectionOf((static_cast<float>(x) + 0.5f) / static_cast<float>(width()),
                     (static_cast<float>(y) + 0.5f) / static_cast<float>(height()));
}

float EnvironmentLight::CellSolidAngle(int y) const {
  const double step = kPi / height();
  return static_cast<float>((std::cos(y * step) - std::cos((y + 1) * step)) * 2 * kPi / width());
}

void EnvironmentLight::CellOf(Vec3f dir, int& x, int& y) const {
  const float phi = std::atan2(dir.z, dir.x) / (2 * kPiF);
  const float u = phi < 0 ? phi + 1 : phi;
  const float v = std::acos(std::clamp(dir.y, -1.0f, 1.0f)) / kPiF;
  x = std::clamp(static_cast<int>(u * static_cast<float>(width())), 0, width() - 1);
  y = std::clamp(static_cast<int>(v * static_cast<float>(height())), 0, height() - 1);
}

Rgb EnvironmentLight::Radiance(Vec3f dir) const {
  switch (environment_.type) {
    case EnvironmentType::kNone:
      return {};
    case EnvironmentType::kConstant:
      return environment_.radiance;
    case EnvironmentType::kGradient:
      return dir.y < 0 ? environment_.ground
                       : environment_.horizon + (environment_.zenith - environment_.horizon) * dir.y;
    case EnvironmentType::kLatLong:
      break;
  }
  int x = 0, y = 0;
  CellOf(dir, x, y);
  return environment_
      .latlong[static_cast<size_t>(y) * static_cast<size_t>(environment_.width) + static_cast<size_t>(x)];
}

EnvironmentLight::Sample EnvironmentLight::Draw(Vec2f u) const {
  const auto cell = table_.Draw(u);
  // Uniform in solid angle within the cell: rows are cut by cosine, not by angle.
  const float step = kPiF / static_cast<float>(height());
  const float top = std::cos(static_cast<float>(cell.y) * step),
              bottom = std::cos(static_cast<float>(cell.y + 1) * step);
  const float within = cell.position.y * static_cast<float>(height()) - static_cast<float>(cell.y);
  const float y = top + (bottom - top) * within;
  const float s = std::sqrt(std::max(0.0f, 1 - y * y)), phi = cell.position.x * 2 * kPiF;
  const float cells = static_cast<float>(width()) * static_cast<float>(height());
  return {{s * std::cos(phi), y, s * std::sin(phi)}, cell.pdf / cells / CellSolidAngle(cell.y)};
}

float EnvironmentLight::Pdf(Vec3f dir) const {
  int x = 0, y = 0;
  CellOf(dir, x, y);
  const float cells = static_cast<float>(width()) * static_cast<float>(height());
  return table_.Pdf(x, y) / cells / CellSolidAngle(y);
}

}  // namespace bakewell
