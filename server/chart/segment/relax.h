#pragma once

#include <cstdint>
#include <vector>

#include "server/chart/mesh/surface.h"

namespace bakewell::chart {

// One step of Lloyd's relaxation on charts: every chart's innermost face becomes its seed, all seeds grow at once,
// distances being longer over turns and where the normal leaves the chart's mean. Borders become straight and charts
// round; a border on an edge sharper than 30 degrees stays. label: F, chart numbers; returns the new ones, charts stay
// connected. O(n log n).
std::vector<uint32_t> RelaxOnce(const Surface& surface, const std::vector<uint32_t>& label);

}  // namespace bakewell::chart
