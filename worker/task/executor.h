#pragma once

#include <memory>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/artifact/task.h"
#include "core/base/status.h"

namespace bakewell {

// Bytes that several tasks may read at a time.
using Blob = std::shared_ptr<const std::string>;

// A task's inputs in the order of its spec, verified against their digests.
using TaskInputs = std::vector<std::pair<std::string, Blob>>;

// What a task made. Names are plain paths.
struct MadeOutput {
  std::string name;
  std::string bytes;
};
using MadeOutputs = std::vector<MadeOutput>;

// A kind of task and the version of the code that runs it.
struct TaskKind {
  std::string kind;
  uint32_t code_version = 0;
};

// Runs tasks: a pure function of spec and inputs, the same bytes for any number of threads. Called from several threads
// at a time, one per slot; may keep what it prepared for inputs that come again. `stop` asks it to return soon, with
// any status: what it hands in then is thrown away. kInvalidArgument, kFailedPrecondition and kOutOfRange are the
// task's own fault and fail its job; any other failure is tried elsewhere.
class TaskExecutor {
 public:
  virtual ~TaskExecutor() = default;
  virtual std::vector<TaskKind> Kinds() const = 0;
  virtual absl::StatusOr<MadeOutputs> Run(const TaskSpec& spec, const TaskInputs& inputs, std::stop_token stop) = 0;
};

// The input of that name; kInvalidArgument if the spec has none.
absl::StatusOr<Blob> FindInput(const TaskInputs& inputs, std::string_view name);

}  // namespace bakewell
