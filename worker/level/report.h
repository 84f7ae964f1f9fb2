#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

#include "core/artifact/bake_report.h"
#include "core/artifact/level_task.h"
#include "worker/finish/filter.h"
#include "worker/gather/tile.h"

namespace bakewell {

// Sums up what a bake's tasks counted: a tally a page, of which the bake's is made in the order of the pages. One
// thread.
class BakeTally {
 public:
  void Count(const GatherCounters& counters);
  // The final texels of a page, in the order of TexelMap::texels.
  void Count(std::span<const TexelLight> lights, const FilterCounters& filter);
  void Count(Skip skip, const SkipCount& count) { counters_.skip[skip] = count; }
  void Add(const BakeTally& page);
  // Canonical bytes and back; the parser is safe on hostile bytes (kDataLoss).
  std::string Serialize() const;
  static absl::StatusOr<BakeTally> Parse(std::string_view bytes);
  // kInvalidArgument: more samples than one in a million were NaN or infinite.
  absl::StatusOr<BakeReport> Finish(const level_task::PhotonCounts& photons, int64_t overlapping_texels,
                                    const SkipSet& no_skip) const;

 private:
  double EstimatedError() const { return OverMean(variance_); }
  // Root of the mean over valid texels of what sums up to `squares`, over their mean irradiance.
  double OverMean(double squares) const;
  std::array<int64_t*, 11> Integers();

  GatherCounters counters_;
  int64_t texels_ = 0, valid_ = 0, filtered_ = 0, direct_samples_ = 0, indirect_samples_ = 0;
  double variance_ = 0, irradiance_ = 0;  // sums of luminance over valid texels
  double bias_square_ = 0;                // FilterCounters
};

}  // namespace bakewell
