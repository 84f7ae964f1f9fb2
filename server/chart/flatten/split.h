#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/chart/mesh/surface.h"

namespace bakewell::chart {

// Cuts connected faces into connected parts, at least two where there are two faces: two far-apart faces grow
// towards each other, sharp turns being far. O(n log n).
std::vector<std::vector<uint32_t>> SplitInTwo(const Surface& surface, std::span<const uint32_t> faces);

}  // namespace bakewell::chart
