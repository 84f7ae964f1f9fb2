#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace bakewell::store {

// Threads for work that waits for a disk, so that network threads do not. Thread safe; the destructor finishes what was
// posted. Work must not throw.
class IoPool {
 public:
  explicit IoPool(int threads);
  ~IoPool();
  void Post(std::function<void()> work);
  // Does what was posted and ends the threads; what is posted later is dropped.
  void Finish();

 private:
  void Loop();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> queue_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace bakewell::store
