#pragma once

#include <span>
#include <vector>

#include "worker/filter/seams.h"
#include "worker/gather/tile.h"

namespace bakewell {

struct FilterCounters {
  int64_t filtered = 0;  // texels whose mean is of more than themselves
  // Sum over texels of the squared bias that filtering adds [W^2 m^-4, luminance], by Stein's estimate
  // (SimilarTexels::Mean): right on the mean of many texels, and may be negative.
  double bias_square = 0;
  int64_t rays = 0;  // for seams
};

// Smooths the direct and the indirect light of one page's texels, each by weights of its own
// (worker/filter/similarity.h), never with invalid ones; elements as in TexelMap::texels, of which those of other pages
// are left alone. Irradiance and all SH coefficients get the same weights, and every chart keeps its sum, so that what
// is smoothed away is not lost. Then, along `seams`, sorted by texel, light is averaged across charts' borders, where
// charts exchange light and their sums are no longer kept one by one. Uses TBB.
void FilterPage(const TexelMap& map, int page, std::span<TexelLight> lights, std::span<const Seam> seams,
                FilterCounters& counters);

// FindSeams for these lights.
std::vector<Seam> SeamsOf(const World& world, const TexelMap& map, int page, std::span<const TexelLight> lights,
                          FilterCounters& counters);

}  // namespace bakewell
