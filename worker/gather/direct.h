#pragma once

#include <cstdint>
#include <vector>

#include "worker/gather/accumulate.h"
#include "worker/gather/path.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// Chooses among local lights for the texels of one tile. Where there are few, each is a choice of its own; of many,
// those that matter to the tile, the others in groups (a cut through the light tree). The chance of each is its
// unoccluded irradiance at the texel, times how much of it a few probes from the tile's texels saw (never zero for a
// light that can reach the texel, so that the choice stays unbiased); inside a group the tree goes on.
// The weakest, which together bring no texel more than `dispensable` [W m^-2, luminance], are left out; emission among
// them is found by the gather's rays alone.
class TileLights {
 public:
  TileLights(const GatherScene& scene, const TexelMap& map, uint32_t begin, uint32_t end, uint32_t key,
             float dispensable, GatherCounters& counters);

  // The distribution for one texel over the nodes of the tile's cut. Empty where no local light can reach it.
  struct Choice {
    Distribution1D distribution;
    bool empty = true;
    float unoccluded = 0;  // about the irradiance, luminance, of all of them if nothing stood between [W m^-2]
  };
  Choice ForTexel(const Texel& texel, float radius) const;

  // One light for a point of the texel.
  LightTree::Pick Draw(const Choice& choice, const SurfacePoint& point, float u) const;
  float Probability(const Choice& choice, const SurfacePoint& point, int light) const;

  // One light for any point near the tile.
  LightTree::Pick DrawNear(const SurfacePoint& point, float u) const;
  float ProbabilityNear(const SurfacePoint& point, int light) const;

 private:
  struct Node {
    int node = 0;  // of the tree
    bool kept = true;
    bool seen = true;      // by a probe, or it was not probed: there is no other, or it is too weak
    float visibility = 1;  // (0, 1]
  };
  // With the share of a few probes from the tile's texels that see the node; 1 where none could tell.
  Node Probe(int node, std::span<const Texel> texels, const TexelMap& map, uint32_t key,
             GatherCounters& counters) const;

  void HoldBackUnseen(const LitPlace& place);

  const GatherScene& scene_;
  std::vector<Node> cut_;          // at most LightPack::kMost
  LightPack pack_;                 // of the cut, as much of them as is visible
  std::vector<int> cut_of_light_;  // per local light, -1 left out; where anything emits that rays can meet
};

// Suns, and a sky that is not smooth.
enum class Distant : uint8_t { kSampled, kUnseen };

// Direct light of one texel from explicitly sampled lights: the local lights (one sample of one light each), every
// directional light, the sky where it is not smooth. Samples are points [begin, end) of a Sobol set, of `planned` in
// all.
void GatherDirect(const GatherScene& scene, const TexelSampler& sampler, const TileLights& lights,
                  const TileLights::Choice& choice, Distant distant, uint32_t key, uint32_t begin, uint32_t end,
                  Accumulator& sum, GatherCounters& counters);

// Radiance that a gather ray `dir` of density `pdf` finds by itself, emission and sky, weighted against the samples of
// GatherDirect. lights: none where no local light reaches.
Rgb FoundByGather(const GatherScene& scene, const TileLights* lights, const TileLights::Choice& choice,
                  const SurfacePoint& from, Vec3f dir, float pdf, const Hit& hit);

}  // namespace bakewell
