#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "core/artifact/phase_time.h"
#include "core/artifact/progress.h"

namespace bakewell {

// Measures the phases of a bake: wall time, and CPU time of all threads of the process.
class PhaseClock {
 public:
  void Begin(std::string phase);
  void End();
  const std::vector<PhaseTime>& phases() const { return phases_; }
  static double CpuSeconds();
  static double WallSeconds();
  // Most memory that this process had resident at a time; 0 where the system does not say.
  static int64_t PeakMemoryBytes();

 private:
  std::vector<PhaseTime> phases_;
  double wall_ = 0, cpu_ = 0;
};

// Passes progress on, one phase after the other, and starts and stops `clock` with the phases. Where tasks of the next
// phase run before the last one is done, their reports are left out. Thread safe.
class PhaseFollower final : public Progress {
 public:
  PhaseFollower(Progress& listener, PhaseClock& clock) : listener_(listener), clock_(clock) {}
  void Report(std::string_view phase, int64_t done, int64_t total) override;
  // Ends the phase that is running and begins the next one.
  void Enter(std::string_view phase);
  void End();

 private:
  void EnterLocked(std::string_view phase);

  std::mutex mutex_;
  Progress& listener_;
  PhaseClock& clock_;
  bool running_ = false, done_ = true;  // of the phase that runs
};

}  // namespace bakewell
