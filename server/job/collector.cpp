#include "server/job/collector.h"

#include <absl/strings/str_cat.h>

#include <utility>

#include "core/base/caught.h"

namespace bakewell::job {

Collector::Collector(const Options& options, store::Writer& writer, store::BlobStore& blobs,
                     std::function<bool(const TaskKey&)> needed)
    : options_(options), writer_(writer), blobs_(blobs), needed_(std::move(needed)), last_(options.steady_now()) {}

absl::StatusOr<store::CollectReport> Collector::Collect(int64_t target_bytes, int64_t grace_us) {
  return store::Collect(writer_, blobs_, gate_, {target_bytes, options_.wall_now_us(), grace_us}, needed_);
}

void Collector::Tick(store::IoPool& io) {
  if (TakeTurn()) io.Post([this] { CollectByItself(); });
}

bool Collector::TakeTurn() {
  if (options_.collect_every.count() == 0) return false;
  const int hurry = blobs_.total_bytes() > options_.keep_bytes ? 10 : 1;
  const std::lock_guard lock(mutex_);
  if (busy_ || options_.steady_now() - last_ < options_.collect_every / hurry) return false;
  return busy_ = true;
}

void Collector::CollectByItself() {
  const auto report = Caught([&] { return Collect(options_.keep_bytes, store::CollectOptions{}.grace_us); });
  if (!report.ok())
    options_.log(absl::StrCat("could not collect: ", report.status().ToString()));
  else if (report->blobs > 0 || report->results > 0)
    options_.log(absl::StrCat("collected: ", report->results, " results forgotten, ", report->blobs, " blobs of ",
                              report->bytes, " bytes removed"));
  const std::lock_guard lock(mutex_);
  last_ = options_.steady_now();
  busy_ = false;
}

}  // namespace bakewell::job
