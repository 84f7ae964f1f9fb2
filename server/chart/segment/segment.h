#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/chart/mesh/surface.h"
#include "server/chart/options.h"

namespace bakewell::chart {

// Cuts a surface into connected charts: neighbouring regions are merged, cheapest first, until every merge would cost
// more than ChartOptions::maxCost. Returns F chart numbers in 0..charts-1, numbered in the order of their first face.
// seam: 3 F flags, edge k of face f is a seam of the input's UVs (or empty). Costs are ratios, ranked in steps
// of 2^-9, so neither the unit of length nor rounding decides. O(n log n).
std::vector<uint32_t> Segment(const Surface& surface, const ChartOptions& options, std::span<const uint8_t> seam = {});

}  // namespace bakewell::chart
