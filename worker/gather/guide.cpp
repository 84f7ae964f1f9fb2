#include "worker/gather/guide.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr int kRows = GatherGuide::kRows, kColumns = GatherGuide::kColumns, kCells = GatherGuide::kCells;
constexpr size_t kKept = 512;            // rays
constexpr float kGuided = 0.8f;          // share of the rays that follow the light
constexpr float kEverywhere = 0.1f;      // light in every cell, over the mean
constexpr double kLeastGain = 1.2;       // of variance
constexpr double kLeastVariance = 0.05;  // over the mean square; what is less may be the chance of which rays were kept

// Where `value` lies among the cells of a cumulative density, in [0, 1), and the density there.
struct Found {
  int cell;
  float place, density;
};
Found FindIn(std::span<const float> cdf, float value) {
  size_t cell = 0;
  while (cell + 1 < cdf.size() && value >= cdf[cell]) ++cell;
  const float begin = cell == 0 ? 0 : cdf[cell - 1], width = cdf[cell] - begin, count = static_cast<float>(cdf.size());
  const float within = std::clamp((value - begin) / width, 0.0f, 1.0f);
  return {static_cast<int>(cell), std::min((static_cast<float>(cell) + within) / count, 0x1.fffffep-1f), width * count};
}

// Which sixteenth of a turn (x, y) points to, without an arc tangent: tan 22.5, 45 and 67.5 degrees divide a quadrant.
int ColumnOf(float x, float y) {
  static_assert(kColumns == 16);
  const float across = std::fabs(x), up = std::fabs(y);
  const int in_quadrant =
      (up >= 0.41421356f * across ? 1 : 0) + (up >= across ? 1 : 0) + (up >= 2.41421356f * across ? 1 : 0);
  if (y >= 0) return x >= 0 ? in_quadrant : 7 - in_quadrant;
  return x >= 0 ? 15 - in_quadrant : 8 + in_quadrant;
}

}  // namespace

size_t GatherGuide::CellOf(Vec3f local) {
  const int row = std::min(static_cast<int>(GatherRow(local.z) * static_cast<float>(kRows)), kRows - 1);
  return static_cast<size_t>(row * kColumns + ColumnOf(local.x, local.y));
}

GatherGuide::GatherGuide(const std::array<float, kCells>& weight) {
  float sum = 0;
  for (int row = 0; row < kRows; ++row) {
    float in_row = 0;
    for (int column = 0; column < kColumns; ++column) {
      in_row += weight[static_cast<size_t>(row * kColumns + column)];
      cell_cdf_[static_cast<size_t>(row * kColumns + column)] = in_row;
    }
    for (int column = 0; column < kColumns; ++column) cell_cdf_[static_cast<size_t>(row * kColumns + column)] /= in_row;
    sum += in_row;
    row_cdf_[static_cast<size_t>(row)] = sum;
  }
  for (float& cdf : row_cdf_) cdf /= sum;
}

GatherGuide::Sample GatherGuide::Draw(Vec2f u) const {
  const Found row = FindIn(row_cdf_, u.x);
  const Found column = FindIn(std::span(cell_cdf_).subspan(static_cast<size_t>(row.cell * kColumns), kColumns), u.y);
  return {{row.place, column.place}, row.density * column.density};
}

void FoundLight::Add(Vec3f place, bool at_infinity, float luminance) {
  if (luminance > 0) rays_.push_back({place, at_infinity, luminance});
}

void FoundLight::Resample(double rays, float u) {
  double sum = 0, square = 0;
  for (const Ray& ray : rays_) {
    sum += static_cast<double>(ray.luminance);
    square += static_cast<double>(ray.luminance) * static_cast<double>(ray.luminance);
  }
  if (!(square > 0)) return;
  mean_share_ = sum * sum / (rays * square);
  const double step = square / static_cast<double>(kKept);
  double passed = 0, next = step * static_cast<double>(u);
  for (const Ray& ray : rays_) {
    passed += static_cast<double>(ray.luminance) * static_cast<double>(ray.luminance);
    for (; next < passed; next += step) kept_.push_back(ray);
  }
  rays_ = {};
}

std::optional<GatherGuide> FoundLight::GuideAt(Vec3f position, const Frame& frame) const {
  std::array<float, kCells> found{}, weight{};
  float in_sight = 0;
  for (const Ray& ray : kept_) {
    const Vec3f dir = frame.ToLocal(ray.at_infinity ? ray.place : NormalizeOrZero(ray.place - position));
    if (!(dir.z > 0)) continue;
    found[GatherGuide::CellOf(dir)] += 1;
    in_sight += 1;
  }
  if (!(in_sight > 0)) return std::nullopt;
  // Each cell's root mean square light, over that of all, blurred by (1 2 1) both ways.
  const float per_cell = static_cast<float>(kCells) / (in_sight * (1 + kEverywhere));
  float mean = 0;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      float light = kEverywhere * in_sight / static_cast<float>(kCells);
      for (int dr = -1; dr <= 1; ++dr) {
        const int r = std::clamp(row + dr, 0, kRows - 1);
        for (int dc = -1; dc <= 1; ++dc) {
          const float share = (dr == 0 ? 0.5f : 0.25f) * (dc == 0 ? 0.5f : 0.25f);
          light += share * found[static_cast<size_t>(r * kColumns + (column + dc + kColumns) % kColumns)];
        }
      }
      float& root = weight[static_cast<size_t>(row * kColumns + column)];
      root = std::sqrt(light * per_cell);
      mean += root / static_cast<float>(kCells);
    }
  }
  // Variances, over the second moment of unguided rays.
  const double guided = static_cast<double>(mean) * static_cast<double>(mean) - mean_share_;
  const double unguided = 1 - mean_share_;
  if (unguided < kLeastVariance || unguided < kLeastGain * guided) return std::nullopt;
  for (float& w : weight) w = (1 - kGuided) * mean + kGuided * w;
  return GatherGuide(weight);
}

}  // namespace bakewell
