#pragma once

#include <cstddef>
#include <span>

#include "worker/sample/distribution.h"
#include "worker/trace/world.h"

namespace bakewell {

// Points of a triangle by how bright they are (World::GlowAt): a density that is constant in each cell of a grid over
// the square of TriangleFromSquare, never 0 where the triangle may glow. Both sides are one. Immutable, thread safe.
//
// Three quarters of the points follow the root mean square of the radiance in a cell, which has the smallest variance
// of all such densities; the others a bound of it (World::GlowOver), since the mean is known from a few points only.
class EmissionTable {
 public:
  // `side` cells along either axis, points x points in each.
  EmissionTable(const World& world, uint32_t triangle, int side, int points);

  struct Sample {
    Vec2f barycentrics;
    float pdf = 1;  // relative to the even density 1 / area
  };
  Sample Draw(Vec2f u) const;
  float Pdf(Vec2f barycentrics) const;

  // Mean radiance of what glows, the front or both sides, by those points; where they are fewer than texels and see
  // nothing, what may lie between them [W m^-2 sr^-1].
  Rgb mean() const { return mean_; }
  // Whether it differs by more than a factor of two over those points.
  bool varies() const { return varies_; }
  // Bound of radiance over pdf at any point, any channel [W m^-2 sr^-1].
  float most_over_pdf() const { return most_over_pdf_; }

  static constexpr int kLeastSide = 8, kMostSide = 256, kLeastPoints = 2, kMostPoints = 8;
  // Cells along either axis that resolve a triangle's textures: two a texel, kLeastSide to kMostSide.
  static int SideFor(const World& world, uint32_t triangle);
  // Points along a cell: as many as texels, kLeastPoints to kMostPoints, and at most so many that a table has
  // `most_points`.
  static int PointsFor(const World& world, uint32_t triangle, int side, double most_points);
  // The largest side, of 256, 128, ..., 8, that all may have, so that those that want `sides` take at most `bytes`
  // together; 0 where there are too many for any.
  static int LargestSide(std::span<const int> sides, size_t bytes);

 private:
  Distribution2D cells_;
  Rgb mean_;
  bool varies_ = false;
  float most_over_pdf_ = 0;
};

}  // namespace bakewell
