#pragma once

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// Orthogonal projection along the area-weighted mean normal; exact for planar charts.
void ProjectOnMeanPlane(const Surface& surface, FlatChart& chart);

// One triangle, laid down by its edge lengths: never flipped, longest edge upright on the u axis.
void LayTriangle(const Surface& surface, FlatChart& chart);

}  // namespace bakewell::chart
