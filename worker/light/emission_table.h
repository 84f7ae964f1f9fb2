#pragma once

#include <cstddef>
#include <span>

#include "worker/sample/distribution.h"
#include "worker/trace/world.h"

namespace bakewell {

// What a triangle and its sides that glow radiate (World::GlowAt), looked at over a fixed pattern that is as fine as
// its textures, up to 256 x 256.
struct Glow {
  Rgb mean;             // [W m^-2 sr^-1]
  bool varies = false;  // by more than a factor of two
};
Glow GlowOf(const World& world, uint32_t triangle);

// Points of a triangle by how bright they are: a density that is constant in each cell of a grid over the square of
// TriangleFromSquare, never 0 where the triangle may glow. Both sides are one. Immutable, thread safe.
//
// Three quarters of the points follow the root mean square of the radiance in a cell, which has the smallest variance
// of all such densities; the others a bound of it (World::MostGlow), since the mean is known from a few points only.
class EmissionTable {
 public:
  // `side` cells along either axis.
  EmissionTable(const World& world, uint32_t triangle, int side);

  struct Sample {
    Vec2f barycentrics;
    float pdf = 1;  // relative to the even density 1 / area
  };
  Sample Draw(Vec2f u) const;
  float Pdf(Vec2f barycentrics) const;

  // Mean radiance, from at least four points a cell [W m^-2 sr^-1].
  Rgb mean() const { return mean_; }
  // Bound of radiance over pdf at any point, any channel [W m^-2 sr^-1].
  float most_over_pdf() const { return most_over_pdf_; }

  // Cells along either axis that resolve a triangle's textures: two a texel, 8 to 256.
  static int SideFor(const World& world, uint32_t triangle);
  // The largest side, of 256, 128, ..., 8, that all may have, so that those that want `sides` take at most `bytes`
  // together; 0 where there are too many for any.
  static int LargestSide(std::span<const int> sides, size_t bytes);

 private:
  Distribution2D cells_;
  Rgb mean_;
  float most_over_pdf_ = 0;
};

}  // namespace bakewell
