#pragma once

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// Makes a chart's map as rigid as possible by local/global iterations (Liu, Zhang, Xu, Gotsman & Gortler 2008, "A
// Local/Global Approach to Mesh Parameterization"): one factorisation, then a rotation per face and two solves a
// step. Starts at chart.uv and ends at the map of the least Sander stretch on the way; where the start has no flipped
// face, no step flips one.
void MakeRigid(const Surface& surface, FlatChart& chart);

}  // namespace bakewell::chart
