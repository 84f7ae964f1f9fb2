#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace bakewell {

// What the tasks of a bake counted, for the manifest. Does not depend on where and in how many pieces they ran.
struct BakeReport {
  std::map<std::string, int64_t> counters;  // slash names: gather/rays, skip/dark_chart
  int64_t rays = 0;
  int64_t photons = 0;
  double estimated_error = 0;  // relative standard error of the irradiance, root mean square over valid texels
  std::vector<std::string> warnings;
};

// One JSON object on a line, and back: the artifact statistics.json. Equal reports have equal text. Parse is safe on
// hostile text: kDataLoss.
std::string ReportJson(const BakeReport& report);
absl::StatusOr<BakeReport> ParseReport(std::string_view json);

}  // namespace bakewell
