#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace bakewell::chart {

// For each position the first index that has bit-equal coordinates (-0 equals 0). O(n) expected.
std::vector<uint32_t> WeldPositions(std::span<const Vec3f> position);

// For each triangle how many earlier ones have the same three vertices in any order: 0 for the first. O(n) expected.
std::vector<uint32_t> CopyRank(std::span<const std::array<uint32_t, 3>> triangle);

}  // namespace bakewell::chart
