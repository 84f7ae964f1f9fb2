#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/artifact/progress.h"
#include "worker/light/lights.h"
#include "worker/photon/cells.h"
#include "worker/photon/guide.h"

namespace bakewell {

inline constexpr int kVarianceGroups = 8;  // photon i belongs to group i mod 8, whatever the batches
inline constexpr int kMaxPhotonBounces = 1024;

// One share of the photons: a light (or the sky) and how many it emits.
struct PhotonSource {
  enum class Kind : uint8_t { kLocal, kDirectional, kSky } kind;
  int light = 0;
  int64_t first = 0, count = 0;  // photons [first, first + count)
  float max_weight = 0;          // bound of a photon's flux, any channel [W]
};

// Who emits what: fixed before the first photon flies, so that photon i is the same in any batch.
struct PhotonPlan {
  std::vector<PhotonSource> sources;
  int64_t photons = 0;
  double fixed_point_scale = 1;  // flux [W] to integer; no sum can pass 2^62
  uint32_t seed = 0;
};

// Splits about `photons` among the lights in proportion to the flux that can matter (luminance).
PhotonPlan PlanPhotons(const LightSet& lights, const EmissionGuide& guide, int64_t photons, uint32_t seed);

// Flux that arrived on one side of one cell, in fixed point: addition is exact and commutes, so batches may run
// anywhere and in any order.
struct CellFlux {
  std::array<int64_t, 3> flux{};
  uint32_t count = 0;                            // photons
  std::array<int64_t, kVarianceGroups> group{};  // luminance, by photon group
};

// Totals of the pass, fixed point as well: emitted = absorbed + escaped.
struct PhotonTotals {
  std::array<int64_t, 3> emitted{}, absorbed{}, escaped{};
  int64_t rays = 0, deposits = 0, cut_paths = 0;
};

// The result of EmitPhotons for any set of batches; element 2 * cell + side (0 front, 1 back).
struct PhotonMap {
  std::vector<CellFlux> flux;
  PhotonTotals totals;
};

// Traces photons [begin, end) of the plan and adds them to `map` (atomically: any number of threads may add to the same
// map). Stops early when `progress` is cancelled.
void EmitPhotons(const World& world, const LightSet& lights, const EmissionGuide& guide, const SurfaceCells& cells,
                 const PhotonPlan& plan, int64_t begin, int64_t end, const Progress& progress, PhotonMap& map);

}  // namespace bakewell
