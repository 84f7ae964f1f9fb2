#include "server/rpc/stall_guard.h"

#include <vector>

namespace bakewell::rpc {

namespace {

constexpr int kRounds = 4;  // looks per limit

}  // namespace

StallGuard::StallGuard(std::chrono::milliseconds limit) : round_(limit / kRounds), thread_([this] { Watch(); }) {}

StallGuard::~StallGuard() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void StallGuard::Watch() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, round_, [this] { return stopping_; })) {
    std::vector<Entry*> stalled;
    for (Entry* entry : entries_) {
      entry->quiet_ = entry->moved_.exchange(false, std::memory_order_relaxed) ? 0 : entry->quiet_ + 1;
      if (entry->quiet_ == kRounds) stalled.push_back(entry);
    }
    for (Entry* entry : stalled) {
      if (entries_.contains(entry)) entry->context_.TryCancel();
    }
  }
}

StallGuard::Entry::Entry(StallGuard& guard, grpc::CallbackServerContext& context) : guard_(guard), context_(context) {
  const std::lock_guard lock(guard_.mutex_);
  guard_.entries_.insert(this);
}

StallGuard::Entry::~Entry() {
  const std::lock_guard lock(guard_.mutex_);
  guard_.entries_.erase(this);
}

}  // namespace bakewell::rpc
