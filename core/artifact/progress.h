#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

namespace bakewell {

// How a long computation says where it is, and learns that it is not wanted any more. Report() is called from any
// thread, at most some hundred times a second; implementations are thread safe.
class Progress {
 public:
  virtual ~Progress() = default;
  // `phase` is one of chart, texels, preview, photons, density, gather, finish, write. Units of work, done <= total.
  virtual void Report(std::string_view phase, int64_t done, int64_t total) = 0;

  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  bool Cancelled() const { return cancelled_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace bakewell
