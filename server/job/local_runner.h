#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "server/job/coordinator.h"

namespace bakewell::job {

struct LocalBlob {
  std::string name, bytes;
};

// A task that the coordinator runs itself, because its code is the server's (charting, assembling). Inputs are
// verified, in the order of the spec.
using LocalTask =
    std::function<absl::StatusOr<std::vector<LocalBlob>>(const TaskSpec& spec, const std::vector<std::string>& inputs)>;

// By kind and version.
struct LocalKind {
  plan::Kind kind;
  LocalTask run;
};
using LocalTasks = std::vector<LocalKind>;

// A worker inside the coordinator's process for LocalTasks, by direct calls. Its threads end with it; the coordinator
// must outlive it.
class LocalRunner {
 public:
  LocalRunner(Coordinator& coordinator, LocalTasks tasks, int threads);
  ~LocalRunner();

 private:
  void Loop(std::stop_token stop);
  void Beat(std::stop_token stop);
  void Run(const TaskLease& lease);
  absl::StatusOr<TaskOutputs> Make(const TaskLease& lease);
  absl::StatusOr<TaskOutput> Store(const LocalBlob& blob);

  Coordinator& coordinator_;
  const LocalTasks tasks_;
  sched::WorkerId worker_{};
  uint64_t connection_ = 0;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<TaskLease> leases_;
  std::vector<std::jthread> threads_;
};

}  // namespace bakewell::job
