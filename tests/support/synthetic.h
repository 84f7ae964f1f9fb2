#pragma once

#include <atomic>
#include <functional>

#include "server/plan/plan.h"
#include "worker/task/executor.h"

namespace bakewell::test {

// Work without light: layers of hash chains, each task fed by two of the layer before, joined at the end. The "scene"
// is its text form. Everything about it is deterministic, so digests of two runs can be compared.
struct SyntheticScene {
  int width = 8, layers = 3;
  int work_us = 1000;   // slept
  int spin_hashes = 0;  // SHA-256 of 64 KiB each: real work, where it is to cost CPU
  int bytes = 256;      // of each output
  int seed = 1;
  bool two_stages = true;  // the layers are planned when the root task is done
  std::string Text() const;
};

class SyntheticPlanner final : public plan::Planner {
 public:
  absl::StatusOr<plan::TaskGraph> Plan(const plan::PlanRequest& request, const plan::BlobReader& read) const override;
  absl::StatusOr<plan::TaskGraph> Continue(const plan::PlanRequest& request, const std::vector<plan::TaskGraph>& so_far,
                                           const TaskOutputs& done, const plan::BlobReader& read) const override;
  std::vector<plan::Kind> Kinds() const override;
};

class SyntheticExecutor final : public TaskExecutor {
 public:
  std::vector<TaskKind> Kinds() const override;
  absl::StatusOr<MadeOutputs> Run(const TaskSpec& spec, const TaskInputs& inputs, std::stop_token stop) override;

  // Called before each task; a status other than OK is the task's result.
  std::function<absl::Status(const TaskSpec&)> before;
  // Changes what a task made: a worker that lies.
  std::function<void(MadeOutputs&)> after;
  // Hands in a part of the result when it is told to stop, as the contract allows.
  bool careless = false;
  std::atomic<int> runs{0};
};

}  // namespace bakewell::test
