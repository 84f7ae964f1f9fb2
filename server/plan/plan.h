#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/task.h"
#include "core/base/status.h"

namespace bakewell::plan {

struct PlannedTask {
  TaskSpec spec;                      // inputs: digests, or outputs of earlier tasks of the same graph
  TaskKey key;                        // KeyOf(spec)
  std::chrono::microseconds cost{0};  // expected run time on one worker
  int64_t memory_bytes = 0;
};

// A file of the job's result; also its partial result, as soon as its task is done.
struct PlannedArtifact {
  std::string name;  // IsPlainPath
  OutputOf source;
};

// What a job has to do, in an order in which no task comes before what it needs.
struct TaskGraph {
  std::vector<PlannedTask> tasks;
  std::vector<PlannedArtifact> artifacts;
  std::vector<TaskKey> deliver;             // tasks of which every output is an artifact, under its own name
  std::optional<TaskKey> next_stage_after;  // when this task is done, Planner::Continue says what follows
};

struct PlanRequest {
  Digest scene;
  std::string settings;  // a serialised BakeSettings
};

// Reads a blob that the store has.
using BlobReader = std::function<absl::StatusOr<std::string>(const Digest&)>;

// A kind of task in the version that this program plans.
struct Kind {
  std::string kind;
  uint32_t code_version = 0;
  friend bool operator==(const Kind&, const Kind&) = default;
};

// Turns (scene, settings) into tasks. Pure: the same arguments and blobs give the same graph. Called from several
// threads. Everything that comes from a client is judged here: kInvalidArgument says what is wrong with it.
class Planner {
 public:
  virtual ~Planner() = default;
  virtual absl::StatusOr<TaskGraph> Plan(const PlanRequest& request, const BlobReader& read) const = 0;
  // The stage that follows task `done`; `so_far` has all stages before it in order.
  virtual absl::StatusOr<TaskGraph> Continue(const PlanRequest& request, const std::vector<TaskGraph>& so_far,
                                             const TaskOutputs& done, const BlobReader& read) const = 0;
  // Every kind that any graph may have; at most 64, its index is the scheduler's capability.
  virtual std::vector<Kind> Kinds() const = 0;
};

// What a planner must keep: keys match specs, needs come first, names are plain, limits hold. kInternal if not.
absl::Status CheckGraph(const TaskGraph& graph, const std::vector<TaskGraph>& so_far);

// For the database. Parse is safe on hostile bytes: kDataLoss.
std::string SerializeGraph(const TaskGraph& graph);
absl::StatusOr<TaskGraph> ParseGraph(std::string_view bytes);

inline constexpr size_t kMaxTasksPerJob = 1'000'000;

}  // namespace bakewell::plan
