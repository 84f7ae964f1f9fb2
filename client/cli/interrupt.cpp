#include "client/cli/interrupt.h"

#include <unistd.h>

#include <atomic>

#include "core/base/check.h"

namespace bakewell {
namespace {

// A signal handler has no other way to what it acts on.
std::atomic<Progress*> cancelled_by_signal{nullptr};
static_assert(std::atomic<Progress*>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void OnSignal(int) {
  Progress* const progress = cancelled_by_signal.load();
  if (progress == nullptr || progress->Cancelled()) ::_exit(kExitCancelled);
  progress->Cancel();
}

}  // namespace

InterruptGuard::InterruptGuard(Progress& progress) {
  BAKEWELL_CHECK(cancelled_by_signal.exchange(&progress) == nullptr);
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, &old_int_);
  ::sigaction(SIGTERM, &action, &old_term_);
}

InterruptGuard::~InterruptGuard() {
  ::sigaction(SIGINT, &old_int_, nullptr);
  ::sigaction(SIGTERM, &old_term_, nullptr);
  cancelled_by_signal.store(nullptr);
}

}  // namespace bakewell
