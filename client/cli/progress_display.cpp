#include "client/cli/progress_display.h"

#include <absl/strings/str_format.h>

#include "core/artifact/json_line.h"

namespace bakewell {
namespace {

constexpr auto kShortestPause = std::chrono::milliseconds(200);

std::string LeftText(const ProgressEstimate& estimate, ProgressEstimate::Time now) {
  const auto left = estimate.TimeLeft(now);
  return left ? DurationText(*left) + " left" : std::string();
}

}  // namespace

ProgressDisplay::~ProgressDisplay() {
  if (bar_open_) stream_ << "\n" << std::flush;
}

void ProgressDisplay::Report(std::string_view phase, int64_t done, int64_t total) {
  const std::lock_guard lock(mutex_);
  const Time now = std::chrono::steady_clock::now();
  const bool new_phase = estimate_.Phase() != phase;
  estimate_.Report(phase, done, total, now);
  if (!Due(new_phase, done == total, now)) return;
  shown_ = now;
  switch (style_) {
    case ProgressStyle::kBar:
      return DrawBar(now);
    case ProgressStyle::kLines:
      return PrintLine(now);
    case ProgressStyle::kJson:
      return PrintJson(done, total, now);
  }
}

bool ProgressDisplay::Due(bool new_phase, bool phase_done, Time now) {
  if (style_ != ProgressStyle::kLines) return new_phase || phase_done || now - shown_ >= kShortestPause;
  const int tenths = static_cast<int>(estimate_.Fraction() * 10);
  const bool due = new_phase || tenths > tenths_shown_;
  tenths_shown_ = tenths;
  return due;
}

void ProgressDisplay::DrawBar(Time now) {
  constexpr int kWidth = 30;
  const int full = static_cast<int>(estimate_.Fraction() * kWidth);
  constexpr char kEraseToEndOfLine[] = "\033[K";
  stream_ << absl::StrFormat("\r%-8s [%s%s] %3d %%  %s%s", estimate_.Phase(), std::string(full, '#'),
                             std::string(kWidth - full, '.'), static_cast<int>(estimate_.Fraction() * 100),
                             LeftText(estimate_, now), kEraseToEndOfLine)
          << std::flush;
  bar_open_ = true;
}

void ProgressDisplay::PrintLine(Time now) {
  stream_ << absl::StrFormat("%-8s %3d %%  %s", estimate_.Phase(), static_cast<int>(estimate_.Fraction() * 100),
                             LeftText(estimate_, now))
          << "\n"
          << std::flush;
}

void ProgressDisplay::PrintJson(int64_t done, int64_t total, Time now) {
  JsonLine line;
  line.Add("event", "progress").Add("phase", estimate_.Phase()).Add("done", done).Add("total", total);
  line.Add("fraction", estimate_.Fraction());
  if (const auto left = estimate_.TimeLeft(now)) line.Add("seconds_left", left->count());
  stream_ << line.Text() << "\n" << std::flush;
}

}  // namespace bakewell
