#pragma once

#include <span>
#include <vector>

#include "core/artifact/chart_report.h"
#include "worker/gather/tile.h"

namespace bakewell {

// The charts of one page, in order. `lights` holds one element per TexelMap::texels.
std::vector<ChartSummary> SummarizeCharts(const TexelMap& map, std::span<const TexelLight> lights, int page);

}  // namespace bakewell
