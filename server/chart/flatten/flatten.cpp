#include "server/chart/flatten/flatten.h"

#include <cmath>
#include <optional>

#include "server/chart/flatten/overlap.h"
#include "server/chart/flatten/project.h"
#include "server/chart/flatten/split.h"
#include "server/chart/flatten/stretch.h"

namespace bakewell::chart {
namespace {

// Below this a projection is as good as exact: the stretch's own rounding in a float lightmap is of that size.
constexpr double kExactStretch = 1.00002;

bool IsValid(const Surface& surface, const FlatChart& chart) {
  return !OutlineCrossesItself(chart.uv, BoundaryEdges(surface, chart));
}

std::optional<FlatChart> TryFlatten(const Surface& surface, std::span<const uint32_t> faces,
                                    const ChartOptions& options) {
  FlatChart chart = LocalChart(surface, faces);
  if (faces.size() == 1) {
    LayTriangle(surface, chart);
    return chart;
  }
  ProjectOnMeanPlane(surface, chart);
  const Stretch stretch = MeasureStretch(surface, chart);
  if (stretch.flipped || stretch.l2 > options.maxStretch || !IsValid(surface, chart)) return std::nullopt;
  NormalizeArea(surface, chart);
  return chart;
}

}  // namespace

std::vector<FlatChart> Flatten(const Surface& surface, std::span<const uint32_t> faces, const ChartOptions& options) {
  std::vector<FlatChart> charts;
  std::vector<std::vector<uint32_t>> open{{faces.begin(), faces.end()}};
  while (!open.empty()) {
    const std::vector<uint32_t> part = std::move(open.back());
    open.pop_back();
    if (std::optional<FlatChart> chart = TryFlatten(surface, part, options)) {
      charts.push_back(*std::move(chart));
      continue;
    }
    for (auto& half : SplitInTwo(surface, part)) open.push_back(std::move(half));
  }
  return charts;
}

}  // namespace bakewell::chart
