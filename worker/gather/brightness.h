#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/photon/cache.h"

namespace bakewell {

// How bright the photons found each side of the cells to be, added up over squares of 2 x 2, 4 x 4, ... cells up to the
// whole patch: what is bright can be looked for from the coarse to the fine.
class BrightnessPyramid {
 public:
  static constexpr size_t kMostPatches = 16384;  // sides of patches

  // cells: outlives it. Of those sides of patches whose squares of irradiance are the largest in sum.
  BrightnessPyramid(const SurfaceCells& cells, const RadianceCache& cache, size_t most_patches = kMostPatches);

  // One side of a square of 2^level x 2^level cells of a patch; the last ones of a row or a column may be smaller.
  struct Square {
    uint32_t patch = 0;
    int level = 0, x = 0, y = 0;  // x, y: in squares of the level
    bool back = false;
    auto operator<=>(const Square&) const = default;
  };
  // Of a square, as if it were flat.
  struct Brightness {
    float flux = 0;                                  // luminance of the irradiance times the area of the surface [W]
    float square = 0;                                // of its square, likewise [W^2 m^-2]
    float Typical() const { return square / flux; }  // irradiance where most of the light is [W m^-2]
  };
  struct Place {
    Vec3f center, u, v;  // u, v: from the centre to the middles of two edges [m]
    Vec3f normal;        // unit, of the side that is meant
    float area = 0;      // of the parallelogram [m^2]
  };
  struct Spot {
    Square square;
    Brightness light;
    Place place;
  };

  // Whole ones, as far as they have light; the largest Typical() first.
  const std::vector<Spot>& patches() const { return patches_; }
  // Appends those that one above level 0 consists of, and that have light.
  void Split(const Square& square, std::vector<Spot>& parts) const;
  bool Holds(const Square& square, uint32_t triangle, Vec3f position) const;

 private:
  struct Sum {
    std::array<Brightness, 2> side;  // front, back
    float area = 0, depth = 0;       // of the surface [m^2]; its distance from the patch's plane, times that
    Sum& operator+=(const Sum& other);
  };
  struct Size {
    int width, height;  // in squares of a level
    size_t count() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  };
  Size SizeAt(uint32_t patch, int level) const;
  Spot SpotOf(const Square& square) const;
  Square Whole(uint32_t patch, bool back) const;
  Sum SumOf(const SurfaceCell& cell, const CachedLight* sides) const;
  void AddPatch(uint32_t patch, const RadianceCache& cache);

  static constexpr uint32_t kNone = ~0u;
  const SurfaceCells& cells_;
  std::vector<uint32_t> first_;  // of a patch's sums; kNone: it is not among patches_
  std::vector<Sum> sums_;        // patch by patch, level by level, row by row
  std::vector<Spot> patches_;
};

}  // namespace bakewell
