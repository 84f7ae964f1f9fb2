#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/chart/flatten/flat_chart.h"
#include "server/chart/options.h"

namespace bakewell::chart {

// Lays connected faces into the plane, as few charts as the promises allow: no face flipped, no two faces of a
// chart overlapping, Sander stretch within ChartOptions::maxStretch. Flat faces are projected exactly; curved ones are
// projected or mapped conformally and then made as rigid as possible; what breaks a promise is cut in two and tried
// again. Areas in the plane equal areas in space per chart. Every face given is in exactly one chart. Pure.
std::vector<FlatChart> Flatten(const Surface& surface, std::span<const uint32_t> faces, const ChartOptions& options);

}  // namespace bakewell::chart
