#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <unordered_map>

#include "core/base/fields.h"
#include "worker/task/executor.h"

namespace bakewell {

// The blobs used last, at most `max_bytes` of them (and whatever running tasks still hold). Two that ask for the same
// blob cause one fetch. Thread safe.
class BlobCache {
 public:
  using Fetch = std::function<absl::StatusOr<std::string>(const Digest&)>;
  BlobCache(int64_t max_bytes, Fetch fetch) : max_bytes_(max_bytes), fetch_(std::move(fetch)) {}

  // From the cache, or fetched on this thread; waits if another thread is at it.
  absl::StatusOr<Blob> Get(const Digest& digest);
  // What this worker made: likely to be asked for next.
  void Put(const Digest& digest, Blob blob);

  int64_t size_bytes() const;
  uint64_t hits() const;
  uint64_t misses() const;

 private:
  struct Entry {
    Digest digest;
    Blob blob;
  };
  void Insert(const Digest& digest, Blob blob);
  Blob Find(const Digest& digest);

  const int64_t max_bytes_;
  const Fetch fetch_;
  mutable std::mutex mutex_;
  std::condition_variable fetched_;
  std::list<Entry> entries_;  // used last first
  std::unordered_map<Digest, std::list<Entry>::iterator, DigestHash> index_;
  std::unordered_map<Digest, int, DigestHash> fetching_;
  int64_t size_bytes_ = 0;
  uint64_t hits_ = 0, misses_ = 0;
};

}  // namespace bakewell
