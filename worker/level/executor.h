#pragma once

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <optional>

#include "core/artifact/level_task.h"
#include "core/artifact/progress.h"
#include "worker/gather/brightness.h"
#include "worker/level/photons.h"
#include "worker/task/executor.h"

namespace bakewell {

struct LevelExecutorOptions {
  // Shared by the loops of all tasks that run; 1: every task has its slot's thread, and photon density TBB's.
  int threads = 1;
  // TBB has at most as many threads in this process while the executor lives; 0: it is not limited here.
  int process_threads = 0;
  // Hears of every tile, batch of photons and page of the one job that runs here; outlives the executor.
  Progress* progress = nullptr;
};

// Runs the tasks of a bake (core/artifact/level_task.h), except charting, which is the coordinator's. Keeps the levels
// used last, so that the tasks of one job share scene, BVH, texels and cells.
class LevelExecutor final : public TaskExecutor {
 public:
  explicit LevelExecutor(const LevelExecutorOptions& options = {});
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
    std::shared_ptr<const PhotonStage> stage;
    RadianceCache cache;
    std::optional<BrightnessPyramid> brightness;
    float mean_irradiance = 0, photon_flux = 0;
  };
  absl::StatusOr<std::shared_ptr<const Level>> LevelOf(const Work& work, Progress* listener = nullptr);
  absl::StatusOr<std::shared_ptr<const PhotonStage>> PhotonStageOf(
      const Work& work, const Level& level, const std::shared_ptr<const PhotonStage>& made = nullptr);

  absl::StatusOr<MadeOutputs> Survey(const Work& work);
  absl::StatusOr<MadeOutputs> Emit(const Work& work);
  absl::StatusOr<MadeOutputs> Density(const Work& work);
  absl::StatusOr<MadeOutputs> Gather(const Work& work);
  absl::StatusOr<MadeOutputs> Finish(const Work& work);
  absl::StatusOr<MadeOutputs> Report(const Work& work);

  void Say(std::string_view phase, int64_t done, int64_t total) const;
  void InArena(const std::function<void()>& work);
  // Calls body(i) for 0 <= i < count, on all threads if there are more than one.
  void ForEach(int count, const std::function<void(int)>& body);

  const LevelExecutorOptions options_;
  std::optional<tbb::global_control> limit_;
  std::unique_ptr<tbb::task_arena> arena_;  // if there is more than one thread
  std::atomic<int64_t> photons_done_{0}, tiles_done_{0}, pages_done_{0};
  Recent<Level> levels_{2};
  Recent<PhotonStage> photon_stages_{2};
  Recent<Photons> photons_{2};
};

}  // namespace bakewell
