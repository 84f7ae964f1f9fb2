#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/chart/options.h"
#include "server/chart/pack/item.h"

namespace bakewell::chart {

// Where every item lies. All pages have one size, a multiple of 4 texels where blocks are kept apart.
struct PackResult {
  int width = 0, height = 0, pages = 0;
  double texels_per_unit = 0;
  std::vector<Placement> placement;  // one per item
  std::vector<double> utilization;   // one per page, touched texels or blocks / all of them
};

// Packs charts so that none come closer than the padding. Without a density the largest is searched at which
// everything fits one page. Same result for any number of threads. Items: at least one.
PackResult Pack(std::span<const PackItem> items, const PackOptions& options);

}  // namespace bakewell::chart
