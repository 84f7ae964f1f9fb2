#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/pack/bitmap.h"

namespace bakewell::chart {

using Segment2 = std::array<Vec2d, 2>;

// Every texel that a region touches, by more than 1/128 of its side: texels that the outline runs through, and those
// whose centre lies inside (even-odd). outline: the region's border in texels, all coordinates >= 0, in any order. The
// bitmap is just large enough for the outline; at least one texel is set. O(length + area / 64).
Bitmap RasterizeCover(std::span<const Segment2> outline);

// Cells within `radius` (Chebyshev) of a set cell; the result is 2 * radius larger and its origin -radius.
Bitmap Dilate(const Bitmap& bitmap, int radius);

// Blocks of size x size cells with any set cell; cell (0, 0) of the bitmap is cell (shift_x, shift_y) of block (0, 0).
Bitmap ToBlocks(const Bitmap& bitmap, int size, int shift_x, int shift_y);

// A quarter turn: cell (x, y) goes to (height - 1 - y, x).
Bitmap TurnQuarter(const Bitmap& bitmap);

}  // namespace bakewell::chart
