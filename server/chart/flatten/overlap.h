#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// Whether a chart whose faces all have positive area in the plane covers no point of it twice: its inner vertices are
// surrounded once, its border consists of one outer loop and holes (by their turning), and no two border edges cross (edges
// that only touch do not). `boundary`: BoundaryEdges of the chart. Expected O(m log m + n) for m border edges of similar length.
bool IsInjective(const FlatChart& chart, std::span<const std::array<uint32_t, 2>> boundary);

}  // namespace bakewell::chart
