#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>

#include "server/store/blobs.h"
#include "server/store/writer.h"

namespace bakewell::store {

struct CollectOptions {
  int64_t target_bytes = 0;  // known results are given up, least recently used first, until this much is left
  int64_t now_us = 0;
  // What came or was used since then stays: the task of a blob that nothing names yet may be about to complete.
  int64_t grace_us = 3'600'000'000;
};

struct CollectReport {
  int64_t results = 0, blobs = 0, bytes = 0;
};

// Keeps collections apart from those who have looked up what is known and have not named it in a live job yet. Thread
// safe; a hold may end on another thread than the one that it began on.
class CollectGate {
 public:
  using Hold = std::shared_ptr<void>;  // as long as a copy lives
  // Waits for the step of a collection that is under way.
  Hold Enter();
  // Does a step of a collection while nobody holds; kUnavailable if somebody does all the time.
  absl::Status Alone(const std::function<absl::Status()>& step);

 private:
  void Leave();

  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  int holds_ = 0;
  bool closed_ = false;
};

// Removes what nobody needs: blobs that no known result and no job names, and as long as the store is above the target
// the results used longest ago. `needed` says that a live job has the task; such results and what they name stay. Runs
// on the caller's thread in small steps, each alone behind `gate`; the changes go through `writer`, and kUnavailable
// says that nothing can be written now. Rows go before files, so a crash leaves at most an unnamed file.
absl::StatusOr<CollectReport> Collect(Writer& writer, BlobStore& blobs, CollectGate& gate,
                                      const CollectOptions& options, const std::function<bool(const TaskKey&)>& needed);

}  // namespace bakewell::store
