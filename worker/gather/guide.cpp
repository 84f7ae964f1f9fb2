#include "worker/gather/guide.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
template <size_t kCount>
Found FindIn(std::span<const float, kCount> cdf, float value) {
  int cell = 0;
  for (size_t i = 0; i + 1 < kCount; ++i) cell += value >= cdf[i] ? 1 : 0;
  const auto at = static_cast<size_t>(cell);
  const float begin = cell == 0 ? 0 : cdf[at - 1], width = cdf[at] - begin, count = static_cast<float>(kCount);
  const float within = std::clamp((value - begin) / width, 0.0f, 1.0f);
  return {cell, std::min((static_cast<float>(cell) + within) / count, 0x1.fffffep-1f), width * count};
}

// Which sixteenth of a turn (x, y) points to, without an arc tangent: tan 22.5, 45 and 67.5 degrees divide a quadrant.
inline int ColumnOf(float x, float y) {
  static_assert(kColumns == 16);
  const float across = std::fabs(x), up = std::fabs(y);
  const int in_quadrant =
      (up >= 0.41421356f * across ? 1 : 0) + (up >= across ? 1 : 0) + (up >= 2.41421356f * across ? 1 : 0);
  const int upper = x >= 0 ? in_quadrant : 7 - in_quadrant, lower = x >= 0 ? 15 - in_quadrant : 8 + in_quadrant;
  return y >= 0 ? upper : lower;
}

// A z that is no number counts as 0.
inline int CellAlong(float x, float y, float z) {
  const float row = std::min(std::max(0.0f, GatherRow(z) * static_cast<float>(kRows)), static_cast<float>(kRows - 1));
  return static_cast<int>(row) * kColumns + ColumnOf(x, y);
}

}  // namespace

size_t GatherGuide::CellOf(Vec3f local) { return static_cast<size_t>(CellAlong(local.x, local.y, local.z)); }

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
  const Found row = FindIn(std::span(row_cdf_), u.x);
  const float* cells = cell_cdf_.data() + row.cell * kColumns;
  const Found column = FindIn(std::span<const float, kColumns>(cells, kColumns), u.y);
  return {{row.place, column.place}, row.density * column.density};
}

float GatherGuide::Density(Vec3f local) const {
  const size_t cell = CellOf(local), row = cell / kColumns, column = cell % kColumns;
  const float in_rows = row_cdf_[row] - (row == 0 ? 0 : row_cdf_[row - 1]);
  const float in_row = cell_cdf_[cell] - (column == 0 ? 0 : cell_cdf_[cell - 1]);
  return in_rows * in_row * static_cast<float>(kCells);
}

void FoundLight::Add(Vec3f place, bool at_infinity, float luminance, float density) {
  if (luminance > 0) rays_.push_back({place, at_infinity, luminance, density});
}

void FoundLight::Resample(double rays, float u) {
  double sum = 0, square = 0;
  for (const Ray& ray : rays_) {
    sum += static_cast<double>(ray.luminance);
    square += ray.Square();
  }
  if (!(square > 0)) return;
  mean_share_ = sum * sum / (rays * square);
  const double step = square / static_cast<double>(kKept);
  double passed = 0, next = step * static_cast<double>(u);
  for (const Ray& ray : rays_) {
    passed += ray.Square();
    for (; next < passed && x_.size() < kKept; next += step) {
      x_.push_back(ray.place.x);
      y_.push_back(ray.place.y);
      z_.push_back(ray.place.z);
      near_.push_back(ray.at_infinity ? 0.0f : 1.0f);
    }
  }
  rays_ = {};
}

std::optional<GatherGuide> FoundLight::GuideAt(Vec3f position, const Frame& frame) const {
  // Where each ray's light comes from; kCells: from behind.
  std::array<int, kKept> cell_of;
  const size_t kept = x_.size();
  for (size_t i = 0; i < kept; ++i) {
    const float dx = x_[i] - near_[i] * position.x, dy = y_[i] - near_[i] * position.y,
                dz = z_[i] - near_[i] * position.z;
    const float x = dx * frame.t.x + dy * frame.t.y + dz * frame.t.z,
                y = dx * frame.b.x + dy * frame.b.y + dz * frame.b.z,
                z = dx * frame.n.x + dy * frame.n.y + dz * frame.n.z;
    const float square = std::max(dx * dx + dy * dy + dz * dz, std::numeric_limits<float>::min());
    const int cell = CellAlong(x, y, z / std::sqrt(square));
    cell_of[i] = z > 0 ? cell : kCells;
  }
  std::array<float, kCells + 1> found{};
  for (size_t i = 0; i < kept; ++i) found[static_cast<size_t>(cell_of[i])] += 1;
  const float in_sight = static_cast<float>(kept) - found[kCells];
  if (!(in_sight > 0)) return std::nullopt;
  // Each cell's root mean square light, over that of all, blurred by (1 2 1) both ways.
  std::array<float, kCells> along, weight{};
  for (size_t row = 0; row < kCells; row += kColumns) {
    for (size_t c = 0; c < kColumns; ++c) {
      along[row + c] = 0.25f * found[row + (c + kColumns - 1) % kColumns] + 0.5f * found[row + c] +
                       0.25f * found[row + (c + 1) % kColumns];
    }
  }
  const float per_cell = static_cast<float>(kCells) / (in_sight * (1 + kEverywhere));
  const float everywhere = kEverywhere * in_sight / static_cast<float>(kCells);
  for (size_t row = 0; row < kCells; row += kColumns) {
    const size_t above = row == 0 ? row : row - kColumns, below = row + kColumns == kCells ? row : row + kColumns;
    for (size_t c = 0; c < kColumns; ++c) {
      const float light = everywhere + 0.25f * along[above + c] + 0.5f * along[row + c] + 0.25f * along[below + c];
      weight[row + c] = std::sqrt(light * per_cell);
    }
  }
  float mean = 0;
  for (const float root : weight) mean += root / static_cast<float>(kCells);
  // Variances, over the second moment of unguided rays.
  const double guided = static_cast<double>(mean) * static_cast<double>(mean) - mean_share_;
  const double unguided = 1 - mean_share_;
  if (unguided < kLeastVariance || unguided < kLeastGain * guided) return std::nullopt;
  for (float& w : weight) w = (1 - kGuided) * mean + kGuided * w;
  return GatherGuide(weight);
}

}  // namespace bakewell
