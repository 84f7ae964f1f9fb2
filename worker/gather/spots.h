#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "worker/gather/brightness.h"
#include "worker/gather/path.h"
#include "worker/sample/distribution.h"
#include "worker/texel/texels.h"

namespace bakewell {

// Spots that photons found to be much brighter than a tile is, where sun comes through a window or a lamp hangs close
// to a wall: few rays over the hemisphere meet them, and those few bring much of the light. So a share of a texel's
// gather rays is aimed at them, and all are weighed by the density of both together (the balance heuristic of Veach &
// Guibas 1995, one sample), so that nothing has to be right about the spots but their densities.
class TileSpots {
 public:
  static constexpr size_t kMost = 64;

  // The brightest that a few probes from the tile's texels met; none where they matter little to its rays' variance.
  // expected: irradiance of the tile, luminance, as the photons saw it [W m^-2].
  TileSpots(const GatherScene& scene, const BrightnessPyramid& pyramid, const TexelMap& map,
            std::span<const Texel> texels, float expected, uint32_t key, GatherCounters& counters);

  bool empty() const { return spots_.empty(); }

  // Of one texel.
  struct Choice {
    float share = 0;             // of the rays that are aimed
    Distribution1D which;        // spot
    std::vector<float> density;  // of its points [m^-2], kMost
  };
  Choice ForTexel(const Texel& texel) const;

  // The point to aim at, from uniform u.
  Vec3f Draw(const Choice& choice, Vec2f u) const;
  // Density of the aimed rays from a point, along unit `dir` [sr^-1].
  float Density(const Choice& choice, Vec3f from, Vec3f dir) const;

 private:
  struct Spot {
    BrightnessPyramid::Place place;
    float radiance = 0;  // luminance, of as much of it as is visible [W m^-2 sr^-1]
  };
  // Where the tile is.
  struct Ball {
    Vec3f center;
    float radius = 0;
    float SquareDistance(Vec3f position) const;
  };
  static std::vector<BrightnessPyramid::Spot> Brightest(const BrightnessPyramid& pyramid, const Ball& tile,
                                                        float least);
  void Add(const Spot& spot);

  float expected_ = 0;  // irradiance of the tile, luminance
  std::vector<Spot> spots_;
  // Coordinates of their centres and normals, of u and of v over their squares.
  std::array<std::array<float, kMost>, 12> column_{};
};

}  // namespace bakewell
