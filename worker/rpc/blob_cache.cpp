#include "worker/rpc/blob_cache.h"

namespace bakewell {

Blob BlobCache::Find(const Digest& digest) {
  const auto found = index_.find(digest);
  if (found == index_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->blob;
}

void BlobCache::Insert(const Digest& digest, Blob blob) {
  if (Find(digest) != nullptr) return;
  size_bytes_ += static_cast<int64_t>(blob->size());
  entries_.push_front({digest, std::move(blob)});
  index_[digest] = entries_.begin();
  while (size_bytes_ > max_bytes_ && entries_.size() > 1) {
    size_bytes_ -= static_cast<int64_t>(entries_.back().blob->size());
    index_.erase(entries_.back().digest);
    entries_.pop_back();
  }
}

absl::StatusOr<Blob> BlobCache::Get(const Digest& digest) {
  {
    std::unique_lock lock(mutex_);
    fetched_.wait(lock, [&] { return !fetching_.contains(digest) || index_.contains(digest); });
    if (Blob blob = Find(digest)) {
      ++hits_;
      return blob;
    }
    ++misses_;
    fetching_[digest] = 1;
  }
  absl::StatusOr<std::string> bytes = fetch_(digest);
  const std::lock_guard lock(mutex_);
  fetching_.erase(digest);
  fetched_.notify_all();
  if (!bytes.ok()) return bytes.status();
  Blob blob = std::make_shared<const std::string>(*std::move(bytes));
  Insert(digest, blob);
  return blob;
}

void BlobCache::Put(const Digest& digest, Blob blob) {
  const std::lock_guard lock(mutex_);
  Insert(digest, std::move(blob));
}

int64_t BlobCache::size_bytes() const {
  const std::lock_guard lock(mutex_);
  return size_bytes_;
}

uint64_t BlobCache::hits() const {
  const std::lock_guard lock(mutex_);
  return hits_;
}

uint64_t BlobCache::misses() const {
  const std::lock_guard lock(mutex_);
  return misses_;
}

}  // namespace bakewell
