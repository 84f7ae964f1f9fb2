#pragma once

#include <span>
#include <vector>

#include "worker/texel/texels.h"

namespace bakewell {

// An estimator of one texel (light sampling or final gather) that asks for more samples.
struct Claim {
  float error = 0;    // its variance over the square of what the texel tolerates
  float cost = 0;     // of doubling its samples, in any unit
  bool open = false;  // more samples are possible
};

// Which claims are granted: one flag a claim. The claims' errors are to add up to at most `texels`, the number of
// texels that they are of, and none may stay above kWorst squared; what can get no more samples counts as one texel's
// at most. Doubling halves an error, so those that gain most for their cost come first: the sum of costs is least where
// all gain alike (Neyman's allocation, with the marginal rule of Lagrange). Where a lit plain has less noise than it
// may, the penumbra in its middle may have more.
inline constexpr float kWorst = 2;  // standard errors over what is tolerated
std::vector<bool> Allot(std::span<const Claim> claims, size_t texels);

// Of one value a texel, from texel `begin` on: its mean over each texel and those of its eight neighbours that are
// among them, valid and of the same chart.
std::vector<float> MeanOverNeighbours(const TexelMap& map, uint32_t begin, const std::vector<float>& values,
                                      const std::vector<bool>& valid);

}  // namespace bakewell
