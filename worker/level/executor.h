#pragma once

#include "core/artifact/level_task.h"
#include "worker/level/level.h"
#include "worker/task/executor.h"

namespace bakewell {

// Runs the tasks of a bake (core/artifact/level_task.h), except charting, which is the coordinator's. Keeps the levels
// used last, so that the tasks of one job share scene, BVH, texels and cells.
class LevelExecutor final : public TaskExecutor {
 public:
  std::vector<TaskKind> Kinds() const override;
  absl::StatusOr<MadeOutputs> Run(const TaskSpec& spec, const TaskInputs& inputs, std::stop_token stop) override;

 private:
  // Everything that a task looks at, whatever its kind.
  struct Work {
    const TaskSpec& spec;
    const TaskInputs& inputs;
    std::stop_token stop;
    level_task::Settings range;
    BakeSettings settings;
  };
  // The radiance cache with what follows from it.
  struct Photons {
    RadianceCache cache;
    float mean_irradiance = 0;
  };
  absl::StatusOr<std::shared_ptr<const Level>> LevelOf(const Work& work);
  absl::StatusOr<std::shared_ptr<const PhotonStage>> PhotonStageOf(const Work& work, const Level& level);

  absl::StatusOr<MadeOutputs> Survey(const Work& work);
  absl::StatusOr<MadeOutputs> Emit(const Work& work);
  absl::StatusOr<MadeOutputs> Density(const Work& work);
  absl::StatusOr<MadeOutputs> Gather(const Work& work);
  absl::StatusOr<MadeOutputs> Finish(const Work& work);
  absl::StatusOr<MadeOutputs> Report(const Work& work);

  Recent<Level> levels_{2};
  Recent<PhotonStage> photon_stages_{2};
  Recent<Photons> photons_{2};
};

}  // namespace bakewell
