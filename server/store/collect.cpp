#include "server/store/collect.h"

#include <absl/cleanup/cleanup.h>

#include <algorithm>

namespace bakewell::store {

namespace {

constexpr int kPage = 256;
constexpr auto kPatience = std::chrono::seconds(5);  // of a step, with those who hold the gate

absl::Status TakePage(Tables& tables, int64_t before_us, std::vector<BlobRow>& page) {
  BAKEWELL_ASSIGN_OR_RETURN(page, tables.UnreferencedBlobs(before_us, kPage));
  for (const BlobRow& blob : page) BAKEWELL_RETURN_IF_ERROR(tables.DeleteBlob(blob.digest));
  return absl::OkStatus();
}

// Deletes a page of unreferenced blobs, rows first.
absl::Status RemovePage(Writer& writer, BlobStore& blobs, int64_t before_us, std::vector<BlobRow>& page) {
  const auto take = [&](Tables& tables) { return TakePage(tables, before_us, page); };
  BAKEWELL_RETURN_IF_ERROR(writer.TryRun(take));
  for (const BlobRow& blob : page) BAKEWELL_RETURN_IF_ERROR(blobs.Remove(blob.digest));
  return absl::OkStatus();
}

absl::Status RemoveUnreferenced(Writer& writer, BlobStore& blobs, CollectGate& gate, int64_t before_us,
                                CollectReport& report) {
  for (;;) {
    std::vector<BlobRow> page;
    BAKEWELL_RETURN_IF_ERROR(gate.Alone([&] { return RemovePage(writer, blobs, before_us, page); }));
    report.blobs += std::ssize(page);
    for (const BlobRow& blob : page) report.bytes += std::max<int64_t>(0, blob.size_bytes);
    if (page.size() < kPage) return absl::OkStatus();
  }
}

// Where a walk over the known results is, oldest use first.
struct Walk {
  Tables::UsedKey last{INT64_MIN, {}};
  bool ended = false;
  int64_t dropped = 0;
};

// The next page of the walk, without the results that are needed or were used since `before_us`, whose blobs would
// stay; `walk` changes only if all of it could be done.
absl::Status DropPage(Tables& tables, const std::function<bool(const TaskKey&)>& needed, int64_t before_us, Walk from,
                      Walk& walk) {
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<Tables::UsedKey> page, tables.OldestKnown(from.last, kPage));
  std::erase_if(page, [&](const Tables::UsedKey& used) { return used.used_us >= before_us; });
  for (const Tables::UsedKey& used : page) {
    if (needed(used.key)) continue;
    BAKEWELL_RETURN_IF_ERROR(tables.DeleteKnown(used.key));
    ++from.dropped;
  }
  from.ended = page.empty();
  if (!from.ended) from.last = page.back();
  walk = from;
  return absl::OkStatus();
}

}  // namespace

CollectGate::Hold CollectGate::Enter() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !closed_; });
  ++holds_;
  return {this, [](CollectGate* gate) { gate->Leave(); }};
}

void CollectGate::Leave() {
  const std::lock_guard lock(mutex_);
  --holds_;
  changed_.notify_all();
}

absl::Status CollectGate::Alone(const std::function<absl::Status()>& step) {
  {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, kPatience, [this] { return holds_ == 0 && !closed_; })) {
      return absl::UnavailableError("jobs are being planned all the time: nothing can be collected now");
    }
    closed_ = true;
  }
  const auto open = absl::MakeCleanup([this] {
    const std::lock_guard lock(mutex_);
    closed_ = false;
    changed_.notify_all();
  });
  return step();
}

absl::StatusOr<CollectReport> Collect(Writer& writer, BlobStore& blobs, CollectGate& gate,
                                      const CollectOptions& options,
                                      const std::function<bool(const TaskKey&)>& needed) {
  CollectReport report;
  const int64_t before_us = options.now_us - options.grace_us;
  BAKEWELL_RETURN_IF_ERROR(RemoveUnreferenced(writer, blobs, gate, before_us, report));
  Walk walk;
  while (blobs.total_bytes() > options.target_bytes && !walk.ended) {
    const Walk from = walk;
    const auto drop = [&](Tables& tables) { return DropPage(tables, needed, before_us, from, walk); };
    BAKEWELL_RETURN_IF_ERROR(gate.Alone([&] { return writer.TryRun(drop); }));
    report.results = walk.dropped;
    BAKEWELL_RETURN_IF_ERROR(RemoveUnreferenced(writer, blobs, gate, before_us, report));
  }
  return report;
}

}  // namespace bakewell::store
