#include "worker/light/emission_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr int kLeastSide = 8, kMostSide = 256;
constexpr float kEven = 0.5f;         // least over greatest luminance, below which a triangle varies
constexpr double kBoundShare = 0.25;  // of the points, by the bound

// Side of a pattern of `per_texel` points a texel along either axis.
int PatternSide(const World& world, uint32_t triangle, float per_texel) {
  const float points = per_texel * world.GlowTexelsAcross(triangle);
  return points > kLeastSide ? static_cast<int>(std::min(points, static_cast<float>(kMostSide))) : kLeastSide;
}

}  // namespace

Glow GlowOf(const World& world, uint32_t triangle) {
  const Material& material = world.MaterialOf(world.triangles()[triangle]);
  if (material.emission_texture.texture < 0 && world.IsAlwaysMet(triangle)) return {material.emission, false};
  const int side = PatternSide(world, triangle, 1), sides = material.double_sided ? 2 : 1;
  const float step = 1.0f / static_cast<float>(side);
  Rgb sum;
  float least = std::numeric_limits<float>::infinity(), most = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Vec2f b =
          TriangleFromSquare({(static_cast<float>(x) + 0.5f) * step, (static_cast<float>(y) + 0.5f) * step});
      float luminance = 0;
      for (int k = 0; k < sides; ++k) {
        const Rgb glow = world.GlowAt(triangle, b.x, b.y, k == 1);
        sum += glow * (step * step);
        luminance += Luminance(glow);
      }
      least = std::min(least, luminance);
      most = std::max(most, luminance);
    }
  }
  return {sum / static_cast<float>(sides), least < kEven * most};
}

int EmissionTable::SideFor(const World& world, uint32_t triangle) { return PatternSide(world, triangle, 2); }

int EmissionTable::LargestSide(std::span<const int> sides, size_t bytes) {
  for (int largest = kMostSide; largest >= kLeastSide; largest /= 2) {
    size_t sum = 0;
    for (const int side : sides) {
      const auto n = static_cast<size_t>(std::min(side, largest) + 1);
      sum += n * (n * (sizeof(double) + 1) + sizeof(Distribution1D) + 64);  // numbers; what a row takes besides
    }
    if (sum <= bytes) return largest;
  }
  return 0;
}

EmissionTable::EmissionTable(const World& world, uint32_t triangle, int side) {
  const bool both = world.MaterialOf(world.triangles()[triangle]).double_sided;
  const int points = std::max(2, (PatternSide(world, triangle, 1) + side - 1) / side);  // along a cell
  const float step = 1.0f / static_cast<float>(side), point_step = step / static_cast<float>(points);
  std::vector<Rgb> bound;
  std::vector<double> brightness;  // root mean square, times `points`
  double brightness_sum = 0, bound_sum = 0;
  Vec3d sum;
  for (int cell = 0; cell < side * side; ++cell) {
    const Vec2f corner{static_cast<float>(cell % side) * step, static_cast<float>(cell / side) * step};
    // A cell on the diagonal is two triangles, whose corners are among these as well.
    bound.push_back(world.MostGlow(
        triangle, {TriangleFromSquare(corner), TriangleFromSquare(corner + Vec2f{step, 0}),
                   TriangleFromSquare(corner + Vec2f{0, step}), TriangleFromSquare(corner + Vec2f{step, step})}));
    double squares = 0;
    for (int k = 0; k < points * points && MaxComponent(bound.back()) > 0; ++k) {
      const Vec2f b = TriangleFromSquare(corner + Vec2f{(static_cast<float>(k % points) + 0.5f) * point_step,
                                                        (static_cast<float>(k / points) + 0.5f) * point_step});
      Rgb glow = world.GlowAt(triangle, b.x, b.y, false);
      if (both) glow += world.GlowAt(triangle, b.x, b.y, true);
      sum += ToDouble(glow);
      squares += static_cast<double>(Luminance(glow)) * static_cast<double>(Luminance(glow));
    }
    brightness.push_back(std::sqrt(squares));
    brightness_sum += brightness.back();
    bound_sum += static_cast<double>(Luminance(bound.back()));
  }
  mean_ = ToFloat(sum / (static_cast<double>(bound.size()) * points * points * (both ? 2 : 1)));

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
