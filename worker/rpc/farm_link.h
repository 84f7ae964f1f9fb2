#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/artifact/task.h"
#include "proto/rpc/channel.h"
#include "worker/task/executor.h"

namespace bakewell {

// A worker's side of proto/bakewell/v1/worker.proto, as plain calls. Each blocks at most its deadline. Thread safe.
struct LeasedTask {
  uint64_t token = 0;
  TaskKey key;
  TaskSpec spec;
  int64_t memory_bytes = 0;
};

struct WorkerIdentity {
  std::string name, isa;
  int cores = 1;
  int64_t memory_bytes = 0;
  std::vector<TaskKind> kinds;
};

struct Registration {
  uint64_t worker_id = 0;
  std::chrono::microseconds heartbeat{0};
  std::vector<LeasedTask> adopted;
};

struct LeaseNews {
  std::vector<LeasedTask> leases;
  std::vector<uint64_t> revoked;
  bool drain = false;
  bool superseded = false;  // another stream of this worker took this one's place
};

class FarmLink {
 public:
  explicit FarmLink(std::shared_ptr<Connection> connection);
  ~FarmLink();

  absl::StatusOr<Registration> Register(const WorkerIdentity& identity, const std::vector<TaskKey>& held);
  absl::Status Heartbeat(uint64_t worker_id);
  absl::Status Complete(uint64_t worker_id, const LeasedTask& task, const TaskOutputs& outputs,
                        std::chrono::microseconds run);
  absl::Status Fail(uint64_t worker_id, const LeasedTask& task, const absl::Status& status,
                    const std::vector<Digest>& missing_inputs);
  absl::Status Release(uint64_t worker_id, const std::vector<std::pair<uint64_t, TaskKey>>& leases, bool goodbye);

  // Opens the Lease stream with `credit`, then hands news to `take` until the stream ends; its status. kCancelled after
  // HangUpForGood.
  absl::Status Listen(uint64_t worker_id, int credit, const std::function<void(LeaseNews)>& take);
  // More credit for the open stream; nothing without one.
  void AddCredit(int credit);
  // Ends the Listen that is under way.
  void HangUp();
  // Ends it, and every later one at once.
  void HangUpForGood();

  const Connection& connection() const { return *connection_; }

 private:
  struct Stream;
  const std::shared_ptr<Connection> connection_;
  std::mutex mutex_;  // guards what follows
  std::shared_ptr<Stream> stream_;
  bool hung_up_for_good_ = false;
};

}  // namespace bakewell
