#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/gltf/level.h"
#include "client/local/phase_clock.h"
#include "core/artifact/settings.h"
#include "worker/level/level.h"

namespace bakewell {

// A level that has been charted, built and cut into texels, without a coordinator: for the path tracer, and for tests.
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

}  // namespace bakewell
