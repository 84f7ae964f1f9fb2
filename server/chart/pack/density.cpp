#include "server/chart/pack/density.h"

#include <algorithm>
#include <cmath>

namespace bakewell::chart {

double Demand(const PackItem& item, double density, double gutter) {
  const double scale = density * item.density;
  return item.area * scale * scale + (item.size.x + item.size.y) * scale * (1 + gutter) + (1 + gutter) * (1 + gutter);
}

double EstimateDensity(std::span<const PackItem> items, double gutter, double texels) {
  double area = 0;
  for (const PackItem& item : items) area += item.area * item.density * item.density;
  // Bisection on the logarithm: charts alone, without gutters, bound it from above.
  double high = std::log(std::sqrt(texels / area)), low = high - 20;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2, density = std::exp(middle);
    double demand = 0;
    for (const PackItem& item : items) demand += Demand(item, density, gutter);
    (demand > texels ? high : low) = middle;
  }
  return std::exp(low);
}

double LargestUnclampedDensity(std::span<const PackItem> items, const Raster& raster) {
  double longest = 0;
  for (const PackItem& item : items) longest = std::max(longest, std::max(item.size.x, item.size.y) * item.density);
  return (raster.max_size - 0.5) / longest;
}

}  // namespace bakewell::chart
