#pragma once

#include <csignal>

#include "core/artifact/progress.h"

namespace bakewell {

inline constexpr int kExitCancelled = 130;

// While it lives, the first SIGINT or SIGTERM cancels `progress`, the second ends the process at once with exit code
// 130. One at a time; restores the handlers that were there. `progress` must outlive it.
class InterruptGuard {
 public:
  explicit InterruptGuard(Progress& progress);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
};

}  // namespace bakewell
