#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/chart/options.h"

namespace bakewell {

// Everything `bakewell unwrap` can be asked for.
struct UnwrapRequest {
  std::filesystem::path input, output;  // .obj to .obj, or .glb/.gltf to .glb
  std::filesystem::path picture;        // .png of the pages, charts coloured (name-0.png, ... for several); empty: none
  chart::ChartOptions chart;
  chart::PackOptions pack;
};

// What was made.
struct UnwrapReport {
  int64_t triangles = 0, set_aside = 0;  // set aside: degenerate or not finite, without a chart
  int64_t charts = 0, pages = 0;
  int64_t width = 0, height = 0;  // of every page [texels]
  double texels_per_unit = 0;
  double mean_utilization = 0;                         // of the pages
  double chart_cpu_s = 0, pack_cpu_s = 0, wall_s = 0;  // without reading and writing files
  std::vector<std::string> warnings;                   // of the level's reader
};

// Charts and packs the input and writes the output, whole or not at all. kInvalidArgument: the files or an option.
absl::StatusOr<UnwrapReport> Unwrap(const UnwrapRequest& request);

}  // namespace bakewell
