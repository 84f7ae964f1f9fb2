#include "tests/support/bake_scene.h"

#include "core/base/check.h"

namespace bakewell {

PreparedLevel PrepareInMemory(const Scene& scene, BakeSettings settings) {
  LoadedLevel level;
  level.scene = scene;
  PhaseClock clock;
  SilentProgress progress;
  settings.uv = UvMode::kKeep;
  auto prepared = PrepareLevel(std::move(level), settings, clock, progress);
  if (!prepared.ok()) CheckFailed(__FILE__, __LINE__, std::string(prepared.status().message()));
  return *std::move(prepared);
}

BakedScene BakeSceneInMemory(const Scene& scene, BakeSettings settings) {
  settings.uv = UvMode::kKeep;
  PhaseClock clock;
  SilentProgress progress;
  BakedScene result{PrepareInMemory(scene, settings), {}};
  auto baked = BakeTexels(result.prepared, settings, clock, progress);
  if (!baked.ok()) CheckFailed(__FILE__, __LINE__, std::string(baked.status().message()));
  result.baked = *std::move(baked);
  return result;
}

}  // namespace bakewell
