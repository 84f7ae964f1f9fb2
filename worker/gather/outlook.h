#pragma once

#include <span>

#include "worker/gather/path.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// What few photons and few rays say about a gather over more of both. Variances are of the texels' irradiance, over
// mean * max(irradiance, floor_share * mean), as means over the points looked at; 0 where there is no light.
struct GatherOutlook {
  double photon_variance =
      0;                    // by the finite number of photons, however many rays look; falls as their number or slower
  double ray_variance = 0;  // of one gather ray
  double bounces = 0;       // near hits and cut cells, a gather ray
};

// points: places of texels drawn at random. Every group of photons is an estimate of its own; two sets of rays from the
// same point have the groups' deviations in common and nothing else, so that their covariance is free of the rays' own
// noise.
GatherOutlook LookAhead(const GatherScene& scene, std::span<const TexelPoint> points, float floor_share, uint32_t seed);

}  // namespace bakewell
