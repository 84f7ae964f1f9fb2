#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/math/vec.h"

namespace bakewell::chart {

// Whether a border crosses itself: segments between uv[edge[0]] and uv[edge[1]] that meet in a point inside both.
// Segments that only touch do not cross. For a connected chart whose faces all have positive area in the plane, an
// outline that does not cross itself and has exactly one outer loop means that no two faces overlap.
// Expected O(m log m) for m edges of similar length.
bool OutlineCrossesItself(std::span<const Vec2d> uv, std::span<const std::array<uint32_t, 2>> edge);

}  // namespace bakewell::chart
