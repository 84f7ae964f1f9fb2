#include "server/store/writer.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <chrono>
#include <future>

namespace bakewell::store {

namespace {

constexpr size_t kMaxBatch = 4096;
constexpr auto kRetryPause = std::chrono::milliseconds(100);

bool WorthRetrying(const absl::Status& status) {
  return status.code() == absl::StatusCode::kResourceExhausted || status.code() == absl::StatusCode::kUnavailable;
}

}  // namespace

Writer::Writer(std::unique_ptr<Tables> tables, Durability durability)
    : tables_(std::move(tables)), durability_(durability), thread_([this] { Loop(); }) {}

Writer::~Writer() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Writer::Submit(Work work, Done done) { Enqueue({std::move(work), std::move(done), {}}); }

void Writer::Enqueue(Item item) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(item));
    backlog_.fetch_add(1, std::memory_order_relaxed);
  }
  wake_.notify_one();
}

absl::Status Writer::Run(Work work) {
  std::promise<absl::Status> promise;
  Submit(std::move(work), [&](const absl::Status& status) { promise.set_value(status); });
  return promise.get_future().get();
}

absl::Status Writer::TryRun(Work work) {
  std::promise<absl::Status> promise;
  Enqueue({std::move(work), [&](const absl::Status& status) { promise.set_value(status); }, {}, false});
  return promise.get_future().get();
}

absl::Status Writer::Trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

std::vector<Writer::Item> Writer::TakeBatch() {
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
  std::vector<Item> batch;
  const size_t count = std::min(queue_.size(), kMaxBatch);
  batch.reserve(count);
  for (size_t i = 0; i < count; ++i) batch.push_back(std::move(queue_[i]));
  queue_.erase(queue_.begin(), queue_.begin() + count);
  return batch;
}

void Writer::Loop() {
  for (;;) {
    std::vector<Item> batch = TakeBatch();
    if (batch.empty()) return;
    WriteBatch(batch);
    for (const Item& item : batch) {
      if (item.done) item.done(item.result);
    }
    backlog_.fetch_sub(batch.size(), std::memory_order_relaxed);
  }
}

size_t Writer::TurnAway(std::vector<Item>& items, const absl::Status& why) {
  const auto refused = std::stable_partition(items.begin(), items.end(), [](const Item& item) { return item.patient; });
  for (auto item = refused; item != items.end(); ++item) {
    item->done(absl::UnavailableError(absl::StrCat("nothing can be written now: ", std::string(why.message()))));
  }
  const auto count = static_cast<size_t>(items.end() - refused);
  items.erase(refused, items.end());
  return count;
}

void Writer::WriteBatch(std::vector<Item>& batch) {
  for (;;) {
    const absl::Status status = TryBatch(batch);
    std::unique_lock lock(mutex_);
    trouble_ = status;
    if (status.ok()) break;
    // At the end of the program a disk that is still full costs what nobody has been told is safe.
    if (!WorthRetrying(status) || stopping_ || durability_ == Durability::kScratch) {
      for (Item& item : batch) item.result = status;
      break;
    }
    backlog_.fetch_sub(TurnAway(batch, status) + TurnAway(queue_, status), std::memory_order_relaxed);
    if (batch.empty()) return;
    wake_.wait_for(lock, kRetryPause, [this] { return stopping_; });
  }
  commits_.fetch_add(1, std::memory_order_relaxed);
  works_.fetch_add(batch.size(), std::memory_order_relaxed);
}

absl::Status Writer::TryBatch(std::vector<Item>& batch) {
  BAKEWELL_RETURN_IF_ERROR(tables_->Begin());
  for (Item& item : batch) {
    item.result = tables_->Apart([&] { return item.work(*tables_); });
    if (WorthRetrying(item.result)) {
      tables_->Rollback();
      return item.result;
    }
  }
  const absl::Status committed = tables_->Commit();
  if (!committed.ok()) tables_->Rollback();
  return committed;
}

}  // namespace bakewell::store
