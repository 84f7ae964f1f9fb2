#pragma once

#include <span>

#include "server/chart/pack/item.h"

namespace bakewell::chart {

// Texels that an item takes at a density, with its share of the gutter.
double Demand(const PackItem& item, double density, double gutter);

// The density at which the items' demand is `texels`.
double EstimateDensity(std::span<const PackItem> items, double gutter, double texels);

// Above it some chart would be longer than raster.max_size.
double LargestUnclampedDensity(std::span<const PackItem> items, const Raster& raster);

}  // namespace bakewell::chart
