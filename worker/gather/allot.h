#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "worker/texel/texels.h"

namespace bakewell {

// An estimator of one texel (light sampling or final gather) that asks for more samples.
struct Claim {
  float error = 0;          // its variance over the square of what the texel tolerates
  float cost = 0;           // of doubling its samples, in any unit
  int doublings = 0;        // of its samples that are possible
  int further = 0;          // after those, for the sum alone and below the ceiling
  float weight = 1;         // of the error in the sum
  bool spared_for = false;  // may have of what is to spare
};

// What the estimators of a tile ask for.
struct Demand {
  std::vector<Claim> claims;
  size_t texels = 0;                                         // that the claims are of
  double ceiling = std::numeric_limits<double>::infinity();  // of the sum of costs, for `further` doublings
};

// Which claims are granted: one flag a claim. The claims' errors, weighted, are to add up to at most the number of
// texels, and none may stay above kWorst squared; what can get no more samples counts as one texel's at most. Doubling
// halves an error, so those that gain most for their cost come first: the sum of costs is least where all gain alike
// (Neyman's allocation, with the marginal rule of Lagrange). Where a lit plain has less noise than it may, the penumbra
// in its middle may have more. Granted is who will need to double at all until the sum is met, a few rounds ahead: what
// a penumbra still owes after this round is no reason for the plain to double in it.
// spare: what may be spent once the sum is met, in the unit of the costs, on those that gain most of those that it is
// for; what is granted of it is taken off.
inline constexpr float kWorst = 2;  // standard errors over what is tolerated
std::vector<bool> Allot(const Demand& demand, double& spare);
// Whether Allot grants nothing.
bool IsMet(const Demand& demand);

// What texels of a tile say together. Vectors have one element a texel, from texel `begin` on.
class TilePool {
 public:
  TilePool(const TexelMap& map, uint32_t begin, const std::vector<bool>& valid);
  // Over each texel and those of its eight neighbours that are of the tile, valid and of the same chart.
  std::vector<float> Mean(std::span<const float> values) const;
  // The variance that each texel's number of samples leaves, where neighbours tell what one sample's is, and the
  // chart's part of the tile what is so rare that a neighbourhood has not met it: a texel that judged by what it found
  // would stop where it found little.
  std::vector<float> Variance(std::vector<float> variance, std::span<const int> samples) const;

 private:
  struct Place {
    std::array<uint16_t, 9> near{};  // of the tile
    uint8_t near_count = 0;
    bool valid = false;
    uint16_t chart = 0;  // of those of the tile
  };
  std::vector<Place> places_;
  size_t charts_ = 0;
};

}  // namespace bakewell
