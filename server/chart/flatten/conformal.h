#pragma once

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// Least-squares conformal map (Levy, Petitjean, Ray & Maillot 2002) in the form of Mullen, Tong, Alliez & Desbrun 2008:
// the Dirichlet energy less the area, two far-apart boundary vertices held. Keeps angles, not sizes; may flip faces.
// Returns false where the system cannot be factorised; chart.uv is then unchanged.
bool MapConformally(const Surface& surface, FlatChart& chart);

}  // namespace bakewell::chart
