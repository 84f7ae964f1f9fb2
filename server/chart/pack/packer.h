#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/chart/pack/item.h"

namespace bakewell::chart {

// Pages of width x height cells.
struct Grid {
  int width, height, max_pages;
};

// In which order charts are placed: by cells + long_weight * (longest side)^2, each multiplied by a keyed random factor
// within 1 +- jitter; the largest first, ties by number.
// Of a chart's poses the one is taken whose y + height_weight * height is least.
struct Order {
  double long_weight = 0.25, jitter = 0, height_weight = 1;
  uint32_t seed = 0;
};

// One attempt to place every chart.
struct Trial {
  bool complete = true;                 // false: some chart found no place, the rest of the fields are of no use
  int used_width = 0, used_height = 0;  // cells, of the fullest page
  std::vector<Placement> placement;     // one per chart
  std::vector<int64_t> cells;           // taken, one per page
};

// Places charts one by one, each at its pose's lowest free spot; the next page is begun when none has room. Pure.
Trial PlaceAll(const Grid& grid, std::span<const Candidate> candidates, const Order& order);

}  // namespace bakewell::chart
