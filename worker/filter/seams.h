#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "worker/texel/texels.h"

namespace bakewell {

// Near `texel` its surface goes on in another chart of the page, nearest in texel `other`.
struct Seam {
  uint32_t texel = 0, other = 0;  // TexelMap::texels
  float distance = 0;             // between the two [sides of `texel`]
};

inline constexpr int kSeamReach = 3;     // texels from a chart's border that still know of what lies beyond it
inline constexpr size_t kMostSeams = 4;  // of one texel, each to another chart

// The seams of a page, by texel: where texels at two charts' borders touch in space, face about the same way, are of
// about the same size and lie open to one another (ConnectTexel), and, from texel to texel, up to kSeamReach further
// into either. valid, open (ConnectTexel): one element a texel of the map. Uses TBB.
std::vector<Seam> FindSeams(const World& world, const TexelMap& map, int page, const std::vector<bool>& valid,
                            std::span<const uint8_t> open, int64_t& rays);

}  // namespace bakewell
