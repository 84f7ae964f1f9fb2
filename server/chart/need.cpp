#include "server/chart/need.h"

#include <algorithm>
#include <cmath>

namespace bakewell::chart {
namespace {

// f^2 of a chart for a multiplier of its gradient.
double SquaredFactor(const ChartNeed& chart, double multiplier, const NeedLimits& limits) {
  return std::clamp(multiplier * chart.rms_gradient, limits.least * limits.least, limits.largest * limits.largest);
}

double Texels(std::span<const ChartNeed> charts, double multiplier, const NeedLimits& limits) {
  double sum = 0;
  for (const ChartNeed& chart : charts) sum += chart.area * SquaredFactor(chart, multiplier, limits);
  return sum;
}

}  // namespace

std::vector<float> DensityFactors(std::span<const ChartNeed> charts, const NeedLimits& limits) {
  double area = 0, largest = 0, smallest = INFINITY;
  for (const ChartNeed& chart : charts) {
    area += chart.area;
    largest = std::max(largest, chart.rms_gradient);
    if (chart.rms_gradient > 0) smallest = std::min(smallest, chart.rms_gradient);
  }
  if (!(largest > 0)) return std::vector<float>(charts.size(), 1.0f);

  // The number of texels grows with the multiplier: bisection between where every factor is least and where each is
  // largest.
  double low = std::log(limits.least * limits.least / largest),
         high = std::log(limits.largest * limits.largest / smallest);
  for (int i = 0; i < 80; ++i) {
    const double middle = (low + high) / 2;
    (Texels(charts, std::exp(middle), limits) < area ? low : high) = middle;
  }
  // Where even the limits do not use the budget up (most charts are flat), what is left goes to all alike.
  const double scale = std::sqrt(area / Texels(charts, std::exp(high), limits));
  std::vector<float> factors;
  for (const ChartNeed& chart : charts)
    factors.push_back(static_cast<float>(scale * std::sqrt(SquaredFactor(chart, std::exp(high), limits))));
  return factors;
}

}  // namespace bakewell::chart
