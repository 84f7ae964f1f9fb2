#pragma once

#include <grpcpp/server_context.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <thread>

namespace bakewell::rpc {

// Cancels calls in which nothing has moved for `limit`: uploads that send nothing, readers that read nothing. One
// thread; must outlive its entries.
class StallGuard {
 public:
  explicit StallGuard(std::chrono::milliseconds limit);
  ~StallGuard();

  // A call that is watched from now until the entry goes, which must be before the call's context does.
  class Entry {
   public:
    Entry(StallGuard& guard, grpc::CallbackServerContext& context);
    ~Entry();
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    // Something moved.
    void Touch() { moved_.store(true, std::memory_order_relaxed); }

   private:
    friend class StallGuard;
    StallGuard& guard_;
    grpc::CallbackServerContext& context_;
    std::atomic<bool> moved_{true};
    int quiet_ = 0;  // rounds without a move; the guard's
  };

 private:
  void Watch();

  const std::chrono::milliseconds round_;
  std::recursive_mutex mutex_;  // a cancelled call may end, and its entry go, before TryCancel returns
  std::condition_variable_any wake_;
  std::set<Entry*> entries_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace bakewell::rpc
