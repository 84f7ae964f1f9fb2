#include "worker/light/environment.h"

#include <cmath>

#include "worker/sample/warp.h"

namespace bakewell {
namespace {

// Unit square to sphere: rows are polar angle from +Y, columns azimuth from +X towards +Z.
Vec3f DirectionOf(float u, float v) {
  const float theta = v * kPiF, phi = u * 2 * kPiF;
  const float s = std::sin(theta);
  return {s * std::cos(phi), std::cos(theta), s * std::sin(phi)};
}

}  // namespace

SphereTable::SphereTable(int width, int height, std::span<const float> weights) : cells_(width, height, weights) {
  const double step = kPi / height;
  for (int y = 0; y <= height; ++y) cosine_.push_back(static_cast<float>(std::cos(y * step)));
  for (int y = 0; y < height; ++y) {
    solid_angle_.push_back(static_cast<float>((std::cos(y * step) - std::cos((y + 1) * step)) * 2 * kPi / width));
  }
}

SphereTable::Sample SphereTable::Draw(Vec2f u) const {
  const auto cell = cells_.Draw(u);
  // Uniform in solid angle within the cell: rows are cut by cosine, not by angle.
  const auto row = static_cast<size_t>(cell.y);
  const float within = cell.position.y * static_cast<float>(height()) - static_cast<float>(cell.y);
  const float y = cosine_[row] + (cosine_[row + 1] - cosine_[row]) * within;
  const Vec2f around = Circle(cell.position.x) * std::sqrt(std::max(0.0f, 1 - y * y));
  return {{around.x, y, around.y}, Pdf(cell.x, cell.y), cell.x, cell.y};
}

float SphereTable::Pdf(int x, int y) const {
  return cells_.Pdf(x, y) / (static_cast<float>(width()) * static_cast<float>(height())) / CellSolidAngle(y);
}

EnvironmentLight::EnvironmentLight(const Environment& environment) : environment_(environment) {
  const bool map = environment.type == EnvironmentType::kLatLong;
  const int w = map ? environment.width : 64, h = map ? environment.height : 32;
  std::vector<float> weights(static_cast<size_t>(w) * static_cast<size_t>(h));
  Vec3d fluence;
  table_ = SphereTable(w, h, weights);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Rgb radiance = Radiance(CellCenter(x, y));
      weights[static_cast<size_t>(y) * static_cast<size_t>(w) + static_cast<size_t>(x)] =
          (Luminance(radiance) + MaxComponent(radiance) * 1e-3f) * CellSolidAngle(y);
      fluence += ToDouble(radiance) * static_cast<double>(CellSolidAngle(y));
    }
  }
  table_ = SphereTable(w, h, weights);
  fluence_ = ToFloat(fluence);
  bright_ = MaxComponent(fluence_) > 0;
}

Vec3f EnvironmentLight::CellCenter(int x, int y) const {
  return DirectionOf((static_cast<float>(x) + 0.5f) / static_cast<float>(width()),
                     (static_cast<float>(y) + 0.5f) / static_cast<float>(height()));
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

float EnvironmentLight::Pdf(Vec3f dir) const {
  int x = 0, y = 0;
  CellOf(dir, x, y);
  return table_.Pdf(x, y);
}

}  // namespace bakewell
