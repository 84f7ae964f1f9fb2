#pragma once

#include <span>

#include "core/math/vec.h"
#include "server/chart/pack/footprint.h"

namespace bakewell::chart {

// The unit direction of a side of the smallest rectangle around an outline, among the directions of its convex hull's
// edges; (1, 0) for an outline without extent. O(m log m).
Vec2d LeastRectangleAxis(std::span<const Segment2> outline);

// Extents of an outline along a unit direction and across it.
Vec2d SizeAlong(std::span<const Segment2> outline, Vec2d axis);

}  // namespace bakewell::chart
