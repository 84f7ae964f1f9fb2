#pragma once

#include <algorithm>
#include <cmath>

#include "worker/gather/accumulate.h"

namespace bakewell {

// By what the spread of their blocks overstates the variance of whole Sobol sets of one size: their points repel one
// another, the more the smoother what they sample. Each doubling took something off the variance, and the doublings
// still to come would take off the rest (owing to the variance of an infinite set being zero); they fall as the last
// ones did.
class SetNoise {
 public:
  // In Correction: a tile's texels tell how the doublings fall only so well, and errors are to err on the safe side.
  static constexpr double kMargin = 1.2;

  // A set whose errors are measured in `unit` [W m^-2]. Sets that are too small to tell, or found no light, do not
  // count.
  void Add(const Accumulator& set, float unit) {
    if (!(unit > 0) || set.blocks() < kBlocks || !(Luminance(set.Irradiance()) > 0)) return;
    const double weight = 1 / (static_cast<double>(unit) * static_cast<double>(unit));
    const std::array<double, 3> halvings = set.Halvings();
    for (size_t k = 0; k < halving_.size(); ++k) halving_[k] += halvings[k] * weight;
    variance_ += static_cast<double>(set.LuminanceVariance()) * weight;
    ++sets_;
  }
  size_t sets() const { return sets_; }

  // For Accumulator::Variance, in [0.1, 1].
  float Correction() const {
    if (!(variance_ > 0) || !(halving_[2] > 0)) return 1;
    constexpr double kLeastFall = 0.1, kMostFall = 0.5, kLeast = 0.1;  // 1/2 for independent samples
    const double fall = std::clamp(std::sqrt(halving_[0] / halving_[2]), kLeastFall, kMostFall);
    return static_cast<float>(std::clamp(kMargin * halving_[0] * fall / (1 - fall) / variance_, kLeast, 1.0));
  }

 private:
  std::array<double, 3> halving_{};
  double variance_ = 0;
  size_t sets_ = 0;
};

}  // namespace bakewell
