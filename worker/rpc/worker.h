#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string_view>
#include <thread>

#include "worker/rpc/blob_cache.h"
#include "worker/rpc/farm_link.h"
#include "worker/task/executor.h"

namespace bakewell {

struct WorkerOptions {
  WorkerIdentity identity;  // kinds are the executor's
  int slots = 1;            // tasks at a time; each may use many threads
  int prefetch = 2;         // leases held beyond the slots, whose inputs are fetched meanwhile
  int64_t cache_bytes = int64_t{1} << 30;
  int64_t max_blob_bytes = int64_t{4} << 30;
  bool once = false;                       // leave after one task
  std::chrono::milliseconds idle_exit{0};  // leave after this long without a task; 0: never
  std::chrono::milliseconds grace{30000};  // of a drain: what runs longer goes back
  std::function<void(std::string_view)> log;
  // Called when a result could not be delivered; it is tried again.
  std::function<void(const absl::Status&)> undelivered;
};

struct WorkerCounters {
  int64_t done = 0, failed = 0, given_back = 0, uploaded_bytes = 0, downloaded_bytes = 0;
};

// Takes tasks from a coordinator and runs them, until it is told to drain. It holds no state that matters: whatever a
// crash loses is run again elsewhere. Survives restarts of the coordinator: tasks at work are adopted, results that
// were not acknowledged are sent again.
//
// Threads: one per slot, one that prefetches, two that upload and complete, one for heartbeats, and the caller of
// Run().
class Worker {
 public:
  Worker(std::shared_ptr<Connection> connection, TaskExecutor& executor, WorkerOptions options);
  ~Worker();

  // Works until Drain(), --once or --idle-exit; OK then. kFailedPrecondition, kUnauthenticated, kPermissionDenied,
  // kInvalidArgument: the coordinator refuses this worker.
  absl::Status Run();
  // Asks Run() to return: what runs may finish within the grace. Safe from any thread, not from a signal handler.
  void Drain();
  // Whether every task has returned by then; after Run(). The destructor waits for them, however long they take.
  bool WaitForTasks(std::chrono::milliseconds limit);
  WorkerCounters counters() const;

 private:
  enum class Stage : uint8_t { kQueued, kRunning, kUploading };
  struct Task {
    LeasedTask lease;
    Stage stage = Stage::kQueued;
    bool prefetched = false;
    bool cancelled = false;
    std::stop_source stop;
    MadeOutputs made;
    std::chrono::microseconds run{0};
  };
  using TaskPtr = std::shared_ptr<Task>;

  absl::Status Join();
  absl::Status Session();
  void Take(LeaseNews news);
  void Adopt(const Registration& registration);
  void Revoke(uint64_t token);
  std::vector<TaskKey> Held();
  int FreeCredit() const;
  void Forget(const TaskPtr& task);

  void SlotLoop();
  void PrefetchLoop();
  void UploadLoop();
  void HeartbeatLoop();
  TaskPtr NextToRun();
  void RunTask(const TaskPtr& task);
  absl::StatusOr<TaskInputs> FetchInputs(const Task& task, std::vector<Digest>& missing);
  void Report(const TaskPtr& task, const absl::Status& status, const std::vector<Digest>& missing);
  void Refill();
  void Deliver(const TaskPtr& task);
  absl::Status TryDeliver(const TaskPtr& task, const TaskOutputs& outputs, const std::vector<Blob>& blobs);
  void WaitToLeave();
  bool ShouldLeave();
  bool ShouldLeaveLocked();
  void GiveBackQueued();
  void Leave();
  uint64_t WorkerId() const;
  void Pause(std::chrono::milliseconds time);

  TaskExecutor& executor_;
  const WorkerOptions options_;
  FarmLink link_;
  BlobCache cache_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::map<TaskKey, TaskPtr> tasks_;
  std::deque<TaskPtr> queue_;
  std::deque<TaskPtr> uploads_;
  uint64_t worker_id_ = 0;
  std::chrono::microseconds heartbeat_{std::chrono::seconds(5)};
  int64_t running_bytes_ = 0;
  int running_ = 0;
  bool draining_ = false, ended_ = false;
  std::chrono::steady_clock::time_point idle_since_, drain_at_;
  WorkerCounters counters_;
  std::vector<std::thread> threads_;
};

}  // namespace bakewell
