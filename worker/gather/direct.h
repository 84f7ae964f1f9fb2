#pragma once

#include <vector>

#include "worker/gather/accumulate.h"
#include "worker/gather/path.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// Chooses among local lights for the texels of one tile: by each light's unoccluded irradiance at the texel, times how
// much of it a few probes from the tile's texels saw (never zero for a light that can reach the texel, so that the
// choice stays unbiased).
class TileLights {
 public:
  TileLights(const GatherScene& scene, const TexelMap& map, uint32_t begin, uint32_t end, uint32_t key,
             GatherCounters& counters);

  // The distribution for one texel. Empty where no local light can reach it.
  struct Choice {
    std::vector<int> light;  // lights with a chance
    Distribution1D distribution;
    std::vector<float> probability_of_light;  // per local light, for multiple importance sampling
    bool empty() const { return light.empty(); }
  };
  Choice ForTexel(const Texel& texel, float radius) const;

 private:
  const GatherScene& scene_;
  std::vector<float> visibility_;  // per local light, (0, 1]
};

// Direct light of one texel from explicitly sampled lights: the local lights (one sample of one light each), every
// directional light, the sky where it is not smooth. Samples are points [begin, end) of a Sobol set, of `planned` in
// all.
void GatherDirect(const GatherScene& scene, const TexelSampler& sampler, const TileLights::Choice& choice, uint32_t key,
                  uint32_t begin, uint32_t end, Accumulator& sum, GatherCounters& counters);

}  // namespace bakewell
