#pragma once

#include <absl/container/flat_hash_map.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/base/fields.h"
#include "core/base/sha256.h"
#include "core/base/status.h"
#include "server/store/durability.h"

namespace bakewell::store {

// Content-addressed files: ROOT/blobs/ab/abcd... A blob is written to ROOT/incoming, synced, renamed, and its folder
// synced, so a digest that Has() knows is on disk whole. Reading verifies; a blob that does not match its name is moved
// to ROOT/quarantine and from then on missing. Names come from digests alone, never from the wire. Thread safe.
// Durability::kScratch does not sync, and has ROOT/blobs/abcd...
class BlobStore {
 public:
  // Deletes what a former process left in ROOT/incoming, and holds ROOT/lock as long as it lives. `quota_bytes` 0: no
  // limit. kFailedPrecondition: another process has the store.
  static absl::StatusOr<std::unique_ptr<BlobStore>> Open(const std::filesystem::path& root, int64_t quota_bytes,
                                                         Durability durability = Durability::kSafe);

  ~BlobStore();
  BlobStore(const BlobStore&) = delete;
  BlobStore& operator=(const BlobStore&) = delete;

  // A blob on its way in; forgotten and deleted unless Finish() succeeds. One thread at a time; its store outlives it.
  class Upload {
   public:
    ~Upload();
    Upload(const Upload&) = delete;
    Upload& operator=(const Upload&) = delete;
    // kResourceExhausted: disk or quota full. kInvalidArgument: more bytes than declared.
    absl::Status Append(std::string_view bytes);
    // kDataLoss unless the bytes are those that the digest names.
    absl::Status Finish();
    int64_t size_bytes() const { return size_bytes_; }

   private:
    friend class BlobStore;
    Upload(BlobStore& store, const Digest& digest, int64_t declared_bytes)
        : store_(store), digest_(digest), declared_bytes_(declared_bytes) {}
    BlobStore& store_;
    const Digest digest_;
    const int64_t declared_bytes_;
    std::filesystem::path path_;
    int file_ = -1;
    int64_t size_bytes_ = 0;
    Sha256 hash_;
  };

  // kResourceExhausted: with it, what is stored and what is on its way in would be above the quota.
  absl::StatusOr<std::unique_ptr<Upload>> StartUpload(const Digest& digest, int64_t size_bytes);
  // The whole of a small blob.
  absl::Status Put(const Digest& digest, std::string_view bytes);

  // Reads front to back. Verify() says at the end whether what was read is the blob: kDataLoss if not.
  class Download {
   public:
    ~Download();
    Download(const Download&) = delete;
    Download& operator=(const Download&) = delete;
    // Up to `max_bytes` more; empty at the end.
    absl::StatusOr<std::string> Next(size_t max_bytes);
    // Reads and hashes up to `offset`, so that a resumed transfer is verified as a whole.
    absl::Status Skip(int64_t offset);
    absl::Status Verify();
    int64_t size_bytes() const { return size_bytes_; }

   private:
    friend class BlobStore;
    Download(BlobStore& store, const Digest& digest) : store_(store), digest_(digest) {}
    BlobStore& store_;
    const Digest digest_;
    int file_ = -1;
    int64_t size_bytes_ = 0;
    Sha256 hash_;
  };

  // kNotFound if the store lacks it.
  absl::StatusOr<std::unique_ptr<Download>> StartDownload(const Digest& digest);
  // The whole blob, verified. kDataLoss: it was corrupt, and is now quarantined.
  absl::StatusOr<std::string> Get(const Digest& digest);

  // Gives the blob's file a second name, which outlives the store's own; as it is on disk, unverified. Nobody writes to
  // it: it is the same file. kNotFound; kUnavailable: the file system does not do that (another one, perhaps).
  absl::Status Link(const Digest& digest, const std::filesystem::path& path) const;

  // Tells the store what is there, at start-up, from the database.
  void Learn(const Digest& digest, int64_t size_bytes);
  bool Has(const Digest& digest) const;
  // Size, or -1.
  int64_t SizeOf(const Digest& digest) const;
  // Removes the file; harmless if it is gone.
  absl::Status Remove(const Digest& digest);
  // Out of the way: the blob is missing from now on, its bytes kept for whoever wants to look.
  void Quarantine(const Digest& digest);

  int64_t total_bytes() const { return total_bytes_.load(std::memory_order_relaxed); }
  int64_t quota_bytes() const { return quota_bytes_; }
  uint64_t corrupt() const { return corrupt_.load(std::memory_order_relaxed); }
  size_t count() const;

 private:
  BlobStore(std::filesystem::path root, int64_t quota_bytes, Durability durability, int lock)
      : root_(std::move(root)), quota_bytes_(quota_bytes), durability_(durability), lock_(lock) {}
  std::filesystem::path PathOf(const Digest& digest) const;
  void Forget(const Digest& digest);
  absl::Status CheckQuota(int64_t more_bytes) const;

  const std::filesystem::path root_;
  const int64_t quota_bytes_;
  const Durability durability_;
  const int lock_;  // a file
  mutable std::mutex mutex_;
  absl::flat_hash_map<Digest, int64_t, DigestHash> sizes_;
  std::atomic<int64_t> total_bytes_{0}, incoming_bytes_{0};  // stored; written by uploads that have not ended
  std::atomic<uint64_t> next_name_{0}, corrupt_{0};
};

}  // namespace bakewell::store
