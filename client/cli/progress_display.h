#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <ostream>
#include <string>

#include "client/cli/progress_estimate.h"
#include "core/artifact/progress.h"

namespace bakewell {

enum class ProgressStyle {
  kBar,    // one line that is drawn over, for a terminal
  kLines,  // a line a phase and one each further tenth of the whole, for logs
  kJson,   // {"event":"progress","phase":..,"done":..,"total":..,"fraction":..,"seconds_left":..}, at most 5 a second
};

// Shows progress on a stream, which must outlive it. Report() is thread safe; it never throws and never fails.
class ProgressDisplay : public Progress {
 public:
  ProgressDisplay(std::ostream& stream, ProgressStyle style) : stream_(stream), style_(style) {}
  // Ends the bar's line.
  ~ProgressDisplay() override;

  void Report(std::string_view phase, int64_t done, int64_t total) override;

 private:
  using Time = ProgressEstimate::Time;
  // Whether this report is worth showing.
  bool Due(bool new_phase, bool phase_done, Time now);
  void DrawBar(Time now);
  void PrintLine(Time now);
  void PrintJson(int64_t done, int64_t total, Time now);

  std::mutex mutex_;
  std::ostream& stream_;
  const ProgressStyle style_;
  ProgressEstimate estimate_;
  Time shown_{};
  int tenths_shown_ = 0;
  bool bar_open_ = false;
};

}  // namespace bakewell
