#pragma once

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// How a chart's map from the plane to space stretches (Sander, Snyder, Gortler & Hoppe 2001, "Texture Mapping
// Progressive Meshes", section 3), after scaling to equal area.
struct Stretch {
  bool flipped = false;  // some face has no positive area in the plane
  double l2 = 1;         // sqrt(area-weighted mean of (sigma1^2 + sigma2^2) / 2); 1 is an isometry
};

Stretch MeasureStretch(const Surface& surface, const FlatChart& chart);

// Scales the plane so that the chart's area there is its area in space.
void NormalizeArea(const Surface& surface, FlatChart& chart);

}  // namespace bakewell::chart
