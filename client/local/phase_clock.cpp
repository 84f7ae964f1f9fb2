#include "client/local/phase_clock.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>

namespace bakewell {

double PhaseClock::CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double PhaseClock::WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Not getrusage: its peak survives exec, and would be the caller's where that is larger.
int64_t PhaseClock::PeakMemoryBytes() {
  constexpr std::string_view kPeak = "VmHWM:";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(kPeak)) return std::stoll(line.substr(kPeak.size())) * 1024;
  }
  return 0;
}

void PhaseClock::Begin(std::string phase) {
  phases_.push_back({std::move(phase)});
  wall_ = WallSeconds();
  cpu_ = CpuSeconds();
}

void PhaseClock::End() {
  phases_.back().wall_seconds = WallSeconds() - wall_;
  phases_.back().cpu_seconds = CpuSeconds() - cpu_;
}

void PhaseFollower::Report(std::string_view phase, int64_t done, int64_t total) {
  const std::lock_guard lock(mutex_);
  const auto& phases = clock_.phases();
  const bool is_current = running_ && phases.back().phase == phase;
  if (!is_current) {
    const bool was = std::any_of(phases.begin(), phases.end(), [&](const PhaseTime& p) { return p.phase == phase; });
    if (!done_ || was) return;
    EnterLocked(phase);
    done_ = false;
  }
  done_ = done_ || done >= total;
  listener_.Report(phase, done, total);
}

void PhaseFollower::Enter(std::string_view phase) {
  const std::lock_guard lock(mutex_);
  EnterLocked(phase);
  done_ = true;
}

void PhaseFollower::EnterLocked(std::string_view phase) {
  if (running_) clock_.End();
  clock_.Begin(std::string(phase));
  running_ = true;
}

void PhaseFollower::End() {
  const std::lock_guard lock(mutex_);
  if (running_) clock_.End();
  running_ = false;
}

}  // namespace bakewell
