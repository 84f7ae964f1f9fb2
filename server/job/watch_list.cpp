#include "server/job/watch_list.h"

#include <vector>

namespace bakewell::job {

WatchList::Id WatchList::Add(int64_t job, std::function<void()> changed) {
  const std::lock_guard lock(mutex_);
  watchers_[next_] = {job, std::move(changed)};
  return next_++;
}

void WatchList::Remove(Id watch) {
  std::unique_lock lock(mutex_);
  watchers_.erase(watch);
  idle_.wait(lock, [&] { return notifying_ != watch; });
}

void WatchList::Notify(const std::function<bool(int64_t job)>& has_changed) {
  std::vector<std::pair<Id, int64_t>> all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, watcher] : watchers_) all.emplace_back(id, watcher.job);
  }
  for (const auto& [id, job] : all) {
    if (!has_changed(job)) continue;
    std::function<void()> changed;
    {
      const std::lock_guard lock(mutex_);
      const auto watcher = watchers_.find(id);
      if (watcher == watchers_.end()) continue;
      changed = watcher->second.changed;
      notifying_ = id;
    }
    changed();
    const std::lock_guard lock(mutex_);
    notifying_ = 0;
    idle_.notify_all();
  }
}

}  // namespace bakewell::job
