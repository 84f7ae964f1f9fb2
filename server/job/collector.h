#pragma once

#include <functional>

#include "server/job/options.h"
#include "server/store/collect.h"
#include "server/store/io_pool.h"

namespace bakewell::job {

// Removes what nobody needs, when an operator asks and every so often. Thread safe.
class Collector {
 public:
  // `needed`: a live job has the task.
  Collector(const Options& options, store::Writer& writer, store::BlobStore& blobs,
            std::function<bool(const TaskKey&)> needed);

  // Blocks on disk. kUnavailable: not now.
  absl::StatusOr<store::CollectReport> Collect(int64_t target_bytes, int64_t grace_us);
  // Collects on a thread of `io` if it is time to. The collector must outlive what is posted.
  void Tick(store::IoPool& io);
  // Held from looking up results until a live job names them.
  store::CollectGate& gate() { return gate_; }

 private:
  bool TakeTurn();
  void CollectByItself();

  const Options& options_;
  store::Writer& writer_;
  store::BlobStore& blobs_;
  const std::function<bool(const TaskKey&)> needed_;
  store::CollectGate gate_;

  std::mutex mutex_;  // guards what follows
  sched::Time last_;
  bool busy_ = false;
};

}  // namespace bakewell::job
