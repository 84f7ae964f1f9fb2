#include "worker/light/emission_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr float kEven = 0.5f;         // least over greatest luminance, below which a triangle varies
constexpr double kBoundShare = 0.25;  // of the points, by the bound
constexpr double kMostTexels = 2048;  // under a cell, to know its bound: 7,000 along a triangle

// What a cell's points show.
struct Seen {
  Vec3d sum{};         // radiance
  double squares = 0;  // of luminances
  float least = std::numeric_limits<float>::infinity(), most = 0;
};

// points x points of the cell of `size` at `corner`.
Seen LookAt(const World& world, uint32_t triangle, bool both, Vec2f corner, float size, int points) {
  const float step = size / static_cast<float>(points);
  Seen seen;
  for (int k = 0; k < points * points; ++k) {
    const Vec2f b = TriangleFromSquare(
        corner + Vec2f{(static_cast<float>(k % points) + 0.5f) * step, (static_cast<float>(k / points) + 0.5f) * step});
    Rgb glow = world.GlowAt(triangle, b.x, b.y, false);
    if (both) glow += world.GlowAt(triangle, b.x, b.y, true);
    const float luminance = Luminance(glow);
    seen.sum += ToDouble(glow);
    seen.squares += static_cast<double>(luminance) * static_cast<double>(luminance);
    seen.least = std::min(seen.least, luminance);
    seen.most = std::max(seen.most, luminance);
  }
  return seen;
}

}  // namespace

int EmissionTable::SideFor(const World& world, uint32_t triangle) {
  const float cells = 2 * world.GlowTexelsAcross(triangle);
  return cells > kLeastSide ? static_cast<int>(std::min(cells, static_cast<float>(kMostSide))) : kLeastSide;
}

int EmissionTable::LargestSide(std::span<const int> sides, size_t bytes) {
  for (int largest = kMostSide; largest >= kLeastSide; largest /= 2) {
    size_t sum = 0;
    for (const int side : sides) {
      const auto n = static_cast<size_t>(std::min(side, largest) + 1);
      sum += n * (n * (sizeof(uint32_t) + 1) + sizeof(Distribution1D) + 64);  // numbers; what a row takes besides
    }
    if (sum <= bytes) return largest;
  }
  return 0;
}

int EmissionTable::PointsFor(const World& world, uint32_t triangle, int side, double most_points) {
  const double cells = side;
  const double wanted = std::min(static_cast<double>(world.GlowTexelsAcross(triangle)), std::sqrt(most_points)) / cells;
  return wanted > kLeastPoints ? static_cast<int>(std::min(std::ceil(wanted), static_cast<double>(kMostPoints)))
                               : kLeastPoints;
}

EmissionTable::EmissionTable(const World& world, uint32_t triangle, int side, int points) {
  const bool both = world.MaterialOf(world.triangles()[triangle]).double_sided;
  const float size = 1.0f / static_cast<float>(side);
  std::vector<Rgb> bound;
  std::vector<double> brightness;  // root mean square, times `points`
  double brightness_sum = 0, bound_sum = 0;
  Vec3d sum, bounds;
  Seen all;
  for (int cell = 0; cell < side * side; ++cell) {
    const Vec2f corner{static_cast<float>(cell % side) * size, static_cast<float>(cell / side) * size};
    // A cell on the diagonal is two triangles, whose corners are among these as well.
    const std::array<Vec2f, 4> corners{TriangleFromSquare(corner), TriangleFromSquare(corner + Vec2f{size, 0}),
                                       TriangleFromSquare(corner + Vec2f{0, size}),
                                       TriangleFromSquare(corner + Vec2f{size, size})};
    bound.push_back(world.GlowOver(triangle, corners, kMostTexels).most);
    const bool dark = MaxComponent(bound.back()) <= 0;
    const Seen seen = dark ? Seen{.least = 0} : LookAt(world, triangle, both, corner, size, points);
    sum += seen.sum;
    bounds += ToDouble(bound.back());
    all.least = std::min(all.least, seen.least);
    all.most = std::max(all.most, seen.most);
    brightness.push_back(std::sqrt(seen.squares));
    brightness_sum += brightness.back();
    bound_sum += static_cast<double>(Luminance(bound.back()));
  }
  const double cells = static_cast<double>(bound.size()), of_cell = static_cast<double>(points) * points;
  mean_ = ToFloat(sum / (cells * of_cell * (both ? 2 : 1)));
  const bool resolved = world.GlowTexelsAcross(triangle) <= static_cast<float>(side * points);
  if (MaxComponent(mean_) <= 0 && !resolved) mean_ = ToFloat(bounds / (cells * of_cell));
  varies_ = all.least < kEven * all.most || all.most <= 0;

  if (bound_sum <= 0) return;
  const double seen_share = brightness_sum > 0 ? (1 - kBoundShare) / brightness_sum : 0;
  std::vector<float> weights;
  for (size_t i = 0; i < bound.size(); ++i) {
    weights.push_back(static_cast<float>(seen_share * brightness[i] +
                                         kBoundShare / bound_sum * static_cast<double>(Luminance(bound[i]))));
  }
  cells_ = Distribution2D(side, side, weights);
  for (size_t i = 0; i < bound.size(); ++i) {
    const float pdf = cells_.Pdf(static_cast<int>(i) % side, static_cast<int>(i) / side);
    if (pdf > 0) most_over_pdf_ = std::max(most_over_pdf_, MaxComponent(bound[i]) / pdf);
  }
}

EmissionTable::Sample EmissionTable::Draw(Vec2f u) const {
  const auto drawn = cells_.Draw(u);
  return {TriangleFromSquare(drawn.position), drawn.pdf};
}

float EmissionTable::Pdf(Vec2f barycentrics) const {
  const Vec2f square = SquareFromTriangle(barycentrics);
  const auto cell = [](float x, int cells) {
    return std::clamp(static_cast<int>(x * static_cast<float>(cells)), 0, cells - 1);
  };
  return cells_.Pdf(cell(square.x, cells_.width()), cell(square.y, cells_.height()));
}

}  // namespace bakewell
