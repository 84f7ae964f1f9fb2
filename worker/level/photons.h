#pragma once

#include <absl/functional/function_ref.h>

#include <memory>
#include <optional>

#include "worker/level/level.h"

namespace bakewell {

// What photons are emitted into, and the texels that they are for.
struct PhotonScene {
  const World& world;
  const LightSet& lights;
  int64_t texels;
  // The points that the first `walks` pilot walks start at (EmissionGuide::StartOf).
  absl::FunctionRef<std::vector<TexelPoint>(int walks)> starts;
};

// The starts of a level whose texels come page by page.
std::vector<TexelPoint> StartsOf(const Level& level, int walks, uint32_t seed);

// Who emits what, and the cells that photons land in.
struct PhotonStage {
  EmissionGuide guide;
  PhotonPlan plan;
  SurfaceCells cells;
};
std::shared_ptr<const PhotonStage> BuildPhotonStage(const PhotonScene& scene, int64_t photons, uint32_t seed);

// A pilot's photons, all that `stage` says.
struct FlownPhotons {
  std::shared_ptr<const PhotonStage> stage;
  RadianceCache cache;
  int64_t rays = 0;  // of photons
};
struct PhotonChoice {
  int64_t photons = 0;
  std::optional<FlownPhotons> flown;  // where a pilot flew as many: there is nothing left to do
};

// How many photons the bake needs: as many as bring their noise to a share of the target error. A pilot of few measures
// what theirs is; it is left out where the budget leaves no choice. In a courtyard under sun and sky most light comes
// without photons, in a room behind small windows nearly all of it with the few that came through. Uses TBB; the same
// number for any number of threads. 0 if cancelled.
PhotonChoice PhotonsFor(const PhotonScene& scene, const BakeSettings& settings, const Progress& progress);

// How many cells the photons are stored in.
int64_t CellsFor(int64_t photons);

}  // namespace bakewell
