#pragma once

#include <array>
#include <vector>

#include "core/artifact/progress.h"
#include "core/artifact/skip.h"
#include "worker/photon/emit.h"

namespace bakewell {

// What photons say of one side of one cell: half a cache line, since look-ups are as good as random.
struct alignas(32) CachedLight {
  Rgb irradiance;  // [W m^-2]
  // Per group: irradiance as that eighth of the photons sees it, over the mean of all groups, in 1/kShareUnit.
  std::array<uint16_t, kVarianceGroups> group_share{};
  // Side of the neighbourhood that was averaged, in cells (1, 3, 5, ...); 0: its value is no evidence, since the cell
  // is cut by other geometry and part of it may lie behind a wall, or is too small for photons to tell.
  uint8_t window = 1;

  static constexpr float kShareUnit = 65535.0f / kVarianceGroups;
};

// The photon map as the gather reads it: O(1) per look-up.
struct RadianceCache {
  std::vector<CachedLight> light;  // element 2 * cell + side
  int64_t photons_seen = 0;
  int64_t rays = 0;
  SkipCount unfaced_backs;  // sides of cells whose patch no photon met, of those with surface; rays
};

struct DensityOptions {
  int target_count = 24;     // photons a neighbourhood should hold
  int max_radius = 3;        // cells
  bool probe_unlit = false;  // search the neighbourhoods of sides that no photon met as well
};

// E ~ sum of flux / sum of the area that rays meet (exact where there is no alpha) over the smallest square
// neighbourhood that holds target_count photons and that can be reached from the cell without passing through geometry
// (short rays between cell centres), inside the cell's patch.
RadianceCache EstimateDensity(const World& world, const SurfaceCells& cells, const PhotonMap& map,
                              const PhotonPlan& plan, const DensityOptions& options, Progress& progress);

}  // namespace bakewell
