#pragma once

#include <cstdint>
#include <vector>

#include "core/atlas/layout.h"

namespace bakewell {

// A page as 3 * width * height bytes RGB, row 0 is v = 0: every texel whose centre a triangle covers in a colour of its
// chart, black elsewhere, white where two charts meet.
std::vector<uint8_t> DrawCharts(const AtlasLayout& layout, int page);

}  // namespace bakewell
