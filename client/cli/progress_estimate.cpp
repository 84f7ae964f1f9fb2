#include "client/cli/progress_estimate.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>

namespace bakewell {
namespace {

struct PhaseShare {
  std::string_view phase;
  double share;
};

// Of an interior scene at medium quality. Without the preview, which --density signal alone makes, they add up to 1.
constexpr std::string_view kPreview = "preview";
constexpr std::array<PhaseShare, 8> kShares = {{{"chart", 0.02},
                                                {"texels", 0.03},
                                                {kPreview, 0.15},
                                                {"photons", 0.15},
                                                {"density", 0.05},
                                                {"gather", 0.70},
                                                {"finish", 0.03},
                                                {"write", 0.02}}};

struct Place {
  double before = 0, share = 0;
};

// The shares before and of a phase; nothing for a phase that is not known.
std::optional<Place> PlaceOf(std::string_view phase, bool previewed) {
  double before = 0;
  std::optional<Place> place;
  for (const PhaseShare& entry : kShares) {
    const double share = entry.phase == kPreview && !previewed ? 0 : entry.share;
    if (entry.phase == phase) place = {before, share};
    before += share;
  }
  if (place) *place = {place->before / before, place->share / before};
  return place;
}

}  // namespace

void ProgressEstimate::Report(std::string_view phase, int64_t done, int64_t total, Time now) {
  if (!start_) start_ = now;
  if (phase != phase_) {
    phase_ = phase;
    phase_start_ = now;
    done_ = 0;
  }
  previewed_ = previewed_ || phase == kPreview;
  done_ = std::clamp<int64_t>(done, std::min(done_, total), total);
  total_ = total;
  if (const std::optional<Place> place = PlaceOf(phase_, previewed_)) {
    fraction_ = std::max(fraction_, std::min(place->before + place->share * PhaseFraction(), 1.0));
  }
}

std::optional<std::chrono::duration<double>> ProgressEstimate::TimeLeft(Time now) const {
  constexpr std::chrono::duration<double> kTooEarly(1);
  constexpr double kTooLittle = 0.02;
  const std::optional<Place> place = PlaceOf(phase_, previewed_);
  if (!place || now - *start_ < kTooEarly || PhaseFraction() < kTooLittle) return std::nullopt;
  const std::chrono::duration<double> in_phase = now - *phase_start_;
  const std::chrono::duration<double> phase_left = in_phase * ((1 - PhaseFraction()) / PhaseFraction());
  const std::chrono::duration<double> whole_phases = (now - *start_) + phase_left;
  const double later = std::max(0.0, 1 - place->before - place->share);
  return phase_left + whole_phases * (later / (place->before + place->share));
}

std::string DurationText(std::chrono::duration<double> duration) {
  const auto seconds = static_cast<int64_t>(std::ceil(std::max(duration.count(), 0.0)));
  if (seconds < 60) return absl::StrFormat("%d s", seconds);
  if (seconds < 3600) return absl::StrFormat("%d min %02d s", seconds / 60, seconds % 60);
  return absl::StrFormat("%d h %02d min", seconds / 3600, seconds / 60 % 60);
}

}  // namespace bakewell
