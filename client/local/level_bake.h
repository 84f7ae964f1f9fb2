#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/gltf/level.h"
#include "client/local/bake.h"
#include "core/artifact/manifest.h"
#include "worker/finish/filter.h"
#include "worker/level/level.h"

namespace bakewell {

// Measures the phases of a bake: wall time, and CPU time of all threads of the process.
class PhaseClock {
 public:
  void Begin(std::string phase);
  void End();
  const std::vector<PhaseTime>& phases() const { return phases_; }
  static double CpuSeconds();
  static double WallSeconds();

 private:
  std::vector<PhaseTime> phases_;
  double wall_ = 0, cpu_ = 0;
};

// A level on its way through the phases that a bake and a reference share: chart, build the world, cut texels.
struct PreparedLevel {
  std::unique_ptr<LoadedLevel> level;  // at a fixed address: world and lights refer to its scene
  AtlasLayout layout;
  std::unique_ptr<World> world;
  std::unique_ptr<LightSet> lights;
  TexelMap texels;
  std::vector<std::string> warnings;
};

absl::StatusOr<PreparedLevel> PrepareLevel(LoadedLevel level, const BakeSettings& settings, PhaseClock& clock,
                                           Progress& progress);

// The lit texels of a level, element i for TexelMap::texels[i].
struct BakedTexels {
  std::vector<TexelLight> lights;
  GatherCounters counters;
  FilterCounters filter;
  int64_t photons = 0, photon_rays = 0, density_rays = 0, cells = 0;
};

absl::StatusOr<BakedTexels> BakeTexels(const PreparedLevel& prepared, const BakeSettings& settings, PhaseClock& clock,
                                       Progress& progress);

}  // namespace bakewell
