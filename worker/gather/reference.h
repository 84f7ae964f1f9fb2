#pragma once

#include "core/artifact/progress.h"
#include "worker/light/tree.h"
#include "worker/texel/texels.h"

namespace bakewell {

// One texel's path-traced irradiance.
struct ReferenceTexel {
  Rgb irradiance;            // [W m^-2]
  Rgb half_a, half_b;        // of two independent halves of the samples
  float standard_error = 0;  // of the luminance
  bool valid = true;
};

// An unbiased path tracer over the texels' covered area: no cache, no filter, unlimited bounces by Russian roulette,
// light sampling and cosine sampling combined with the balance heuristic. It shares intersection and light sampling
// with the baker and nothing else. `samples` is a power of two, at least 32. Stops early when cancelled.
std::vector<ReferenceTexel> TraceReference(const World& world, const LightSet& lights, const AtlasLayout& layout,
                                           const TexelMap& map, int samples, uint32_t seed, Progress& progress,
                                           int64_t& rays);

}  // namespace bakewell
