#pragma once

#include <functional>

#include "server/store/blobs.h"
#include "server/store/writer.h"

namespace bakewell::store {

struct CollectOptions {
  int64_t target_bytes = 0;  // known results are given up, least recently used first, until this much is left
  int64_t now_us = 0;
  int64_t grace_us =
      3'600'000'000;  // a blob that nothing names yet is kept this long: its task may be about to complete
};

struct CollectReport {
  int64_t results = 0, blobs = 0, bytes = 0;
};

// Removes what nobody needs: blobs that no known result and no job names, and as long as the store is above the target
// the results used longest ago. `needed` says that a live job has the task; such results and what they name stay. Runs
// on the caller's thread; the changes go through `writer`. Rows go before files, so a crash leaves at most an unnamed
// file.
absl::StatusOr<CollectReport> Collect(Writer& writer, BlobStore& blobs, const CollectOptions& options,
                                      const std::function<bool(const TaskKey&)>& needed);

}  // namespace bakewell::store
