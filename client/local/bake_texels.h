#pragma once

#include <vector>

#include "client/local/level_bake.h"
#include "worker/finish/filter.h"
#include "worker/level/photons.h"

namespace bakewell {

// The lit texels of a level, element i for TexelMap::texels[i].
struct BakedTexels {
  std::vector<TexelLight> lights;
  GatherCounters counters;
  FilterCounters filter;
  int64_t photons = 0, photon_rays = 0, density_rays = 0, cells = 0;
};

// The bare kernels: photons, density, gather and filter over the whole level by direct calls, without tasks. What a
// bake gives has the same bytes, and is measured against the CPU time of this.
absl::StatusOr<BakedTexels> BakeTexels(const PreparedLevel& prepared, const BakeSettings& settings, PhaseClock& clock,
                                       Progress& progress);

}  // namespace bakewell
