#pragma once

#include <cstdint>
#include <vector>

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// What keeps a chart from covering every point of the plane at most once.
struct Conflicts {
  bool wrong_loops = false;    // its border is not one outer loop and holes: only cutting it up helps
  std::vector<uint32_t> face;  // 0 .. n-1, faces without which it may be free of conflicts; may repeat
  bool None() const { return !wrong_loops && face.empty(); }
};

// Flipped faces, vertices that are surrounded more than once, border edges that cross (edges that only touch do not).
// No conflicts: no two faces of the chart overlap. Expected O(m log m + n) for m border edges of similar length.
Conflicts FindConflicts(const Surface& surface, const FlatChart& chart);

}  // namespace bakewell::chart
