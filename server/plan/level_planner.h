#pragma once

#include "core/artifact/settings.h"
#include "server/plan/plan.h"

namespace bakewell::plan {

struct LevelLimits {
  std::chrono::microseconds task = std::chrono::seconds(2);  // work of one task; for workers that give it one thread
  double max_texels = 1 << 27;                               // more are refused: small scenes can ask for any number
  double max_triangles = 1 << 26;                            // likewise: 12 bytes each, of one vertex
};

// Plans bakes (core/artifact/level_task.h): chart and survey first; what the survey counted decides the photon batches
// and tile groups of the second stage, so that a task takes some seconds. Scenes are SerializeScene() blobs with the
// environment inside. Thread safe.
class LevelPlanner final : public Planner {
 public:
  explicit LevelPlanner(const LevelLimits& limits = {}) : limits_(limits) {}
  absl::StatusOr<TaskGraph> Plan(const PlanRequest& request, const BlobReader& read) const override;
  absl::StatusOr<TaskGraph> Continue(const PlanRequest& request, const std::vector<TaskGraph>& so_far,
                                     const TaskOutputs& done, const BlobReader& read) const override;
  std::vector<Kind> Kinds() const override;

 private:
  double TaskUs() const { return static_cast<double>(limits_.task.count()); }

  const LevelLimits limits_;
};

// The settings of a submit, judged: kInvalidArgument for malformed or unknown ones, and for an environment that is not
// part of the scene.
absl::StatusOr<BakeSettings> ReadSettings(const std::string& bytes);

}  // namespace bakewell::plan
