#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace bakewell {

// Where a bake is, from its reports and a clock that is passed in. Pure; not thread safe.
//
// Phases have expected shares of the whole; the time left is what the current phase still needs at its own speed, plus
// the later phases' shares at the speed that was measured so far. So the guess about shares matters less and less.
class ProgressEstimate {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Work [0, done) of `total` units of `phase` is finished at `now`. Phases come in order; one that is skipped counts
  // as done when a later one reports.
  void Report(std::string_view phase, int64_t done, int64_t total, Time now);

  const std::string& Phase() const { return phase_; }
  // Share of the whole in [0, 1]; never falls.
  double Fraction() const { return fraction_; }
  // Nothing in the first second, before 2 % of the current phase, or in a phase that is not known.
  std::optional<std::chrono::duration<double>> TimeLeft(Time now) const;

 private:
  double PhaseFraction() const { return total_ > 0 ? static_cast<double>(done_) / static_cast<double>(total_) : 0; }

  std::string phase_;
  int64_t done_ = 0, total_ = 0;
  double fraction_ = 0;
  bool previewed_ = false;
  std::optional<Time> start_, phase_start_;
};

// "3 s", "2 min 05 s", "1 h 02 min".
std::string DurationText(std::chrono::duration<double> duration);

}  // namespace bakewell
