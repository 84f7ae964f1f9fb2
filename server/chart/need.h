#pragma once

#include <span>
#include <vector>

namespace bakewell::chart {

// What a quick preview knows of a chart.
struct ChartNeed {
  double area = 0;          // in space, any unit
  double rms_gradient = 0;  // of the baked signal per unit of length, root mean square over the chart
};

// Bounds of the factors that DensityFactors gives.
struct NeedLimits {
  double least = 0.25, largest = 4;
};

// Texel density factors, one per chart, that put texels where the signal changes: a texel of side h errs by gradient *
// h / sqrt(12), so the mean squared error is sum(area g^2 / (12 f^2)). It is least, while sum(area f^2) = sum(area)
// keeps the number of texels, for f^2 proportional to g (Lagrange), held within the limits. Charts without gradient get
// the least factor; all get 1 where no chart has any. Pure.
std::vector<float> DensityFactors(std::span<const ChartNeed> charts, const NeedLimits& limits = {});

}  // namespace bakewell::chart
