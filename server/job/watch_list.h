#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>

namespace bakewell::job {

// Who wants to hear of which job. Thread safe; callbacks run on the thread of Notify(), one at a time, without a lock.
class WatchList {
 public:
  using Id = uint64_t;
  Id Add(int64_t job, std::function<void()> changed);
  // The callback is not running any more when this returns; not to be called from it.
  void Remove(Id watch);
  // Calls those whose job has changed. One thread at a time.
  void Notify(const std::function<bool(int64_t job)>& has_changed);

 private:
  struct Watcher {
    int64_t job;
    std::function<void()> changed;
  };
  std::mutex mutex_;
  std::condition_variable idle_;
  std::map<Id, Watcher> watchers_;
  Id next_ = 1, notifying_ = 0;
};

}  // namespace bakewell::job
