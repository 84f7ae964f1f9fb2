#include "server/store/collect.h"

#include <algorithm>

namespace bakewell::store {

namespace {

constexpr int kPage = 256;

absl::Status TakePage(Tables& tables, int64_t before_us, std::vector<BlobRow>& page) {
  BAKEWELL_ASSIGN_OR_RETURN(page, tables.UnreferencedBlobs(before_us, kPage));
  for (const BlobRow& blob : page) BAKEWELL_RETURN_IF_ERROR(tables.DeleteBlob(blob.digest));
  return absl::OkStatus();
}

// Deletes unreferenced blobs, rows first.
absl::Status RemoveUnreferenced(Writer& writer, BlobStore& blobs, int64_t before_us, CollectReport& report) {
  for (;;) {
    std::vector<BlobRow> page;
    const auto take = [&](Tables& tables) { return TakePage(tables, before_us, page); };
    BAKEWELL_RETURN_IF_ERROR(writer.Run(take));
    for (const BlobRow& blob : page) {
      BAKEWELL_RETURN_IF_ERROR(blobs.Remove(blob.digest));
      ++report.blobs;
      report.bytes += std::max<int64_t>(0, blob.size_bytes);
    }
    if (page.size() < kPage) return absl::OkStatus();
  }
}

// Where a walk over the known results is, oldest use first.
struct Walk {
  Tables::UsedKey last{INT64_MIN, {}};
  bool ended = false;
  int64_t dropped = 0;
};

// The next page of the walk, without the results that are needed; `walk` changes only if all of it could be done.
absl::Status DropPage(Tables& tables, const std::function<bool(const TaskKey&)>& needed, Walk from, Walk& walk) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<Tables::UsedKey> page, tables.OldestKnown(from.last, kPage));
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

absl::StatusOr<CollectReport> Collect(Writer& writer, BlobStore& blobs, const CollectOptions& options,
                                      const std::function<bool(const TaskKey&)>& needed) {
  CollectReport report;
  const int64_t before_us = options.now_us - options.grace_us;
  BAKEWELL_RETURN_IF_ERROR(RemoveUnreferenced(writer, blobs, before_us, report));
  Walk walk;
  while (blobs.total_bytes() > options.target_bytes && !walk.ended) {
    const Walk from = walk;
    const auto drop = [&](Tables& tables) { return DropPage(tables, needed, from, walk); };
    BAKEWELL_RETURN_IF_ERROR(writer.Run(drop));
    report.results = walk.dropped;
    BAKEWELL_RETURN_IF_ERROR(RemoveUnreferenced(writer, blobs, before_us, report));
  }
  return report;
}

}  // namespace bakewell::store
