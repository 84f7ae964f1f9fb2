#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace bakewell {

// A piecewise constant density over n cells of [0, 1), sampled by inverting its CDF (keeps the stratification of u).
class Distribution1D {
 public:
  Distribution1D() = default;
  // Weights >= 0, finite. All zero gives the uniform density.
  explicit Distribution1D(std::span<const float> weights);

  struct Sample {
    int index = 0;
    float probability = 0;  // of the index
    float remainder = 0;    // u within the cell, uniform in [0, 1) again
  };
  Sample Draw(float u) const;
  float Probability(int index) const { return static_cast<float>(Width(static_cast<size_t>(index))) * 0x1p-32f; }
  int size() const { return size_; }
  double total() const { return total_; }  // sum of the weights

 private:
  static constexpr uint64_t kOne = uint64_t{1} << 32;
  uint64_t Width(size_t cell) const {
    if (cell >= cdf_.size()) return 0;
    return (cell + 1 < cdf_.size() ? cdf_[cell + 1] : kOne) - cdf_[cell];
  }

  // Where each cell begins, up to the last that has any weight [2^-32]. What has weight is one such part wide at least:
  // it can be drawn, however little it is.
  std::vector<uint32_t> cdf_{0};
  // Where the search for u in [i, i + 1) / size begins: the last cell that begins at i / size or before. Empty for few,
  // and for more than it can tell.
  std::vector<uint16_t> begin_;
  int size_ = 1;
  double total_ = 0;
};

// A piecewise constant density over a width x height grid on the unit square.
class Distribution2D {
 public:
  Distribution2D() = default;
  Distribution2D(int width, int height, std::span<const float> weights);

  struct Sample {
    int x = 0, y = 0;
    Vec2f position;  // in the unit square
    float pdf = 0;   // per unit square area
  };
  Sample Draw(Vec2f u) const;
  float Pdf(int x, int y) const;
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  int width_ = 1, height_ = 1;
  Distribution1D marginal_;           // rows
  std::vector<Distribution1D> rows_;  // columns in each row
};

}  // namespace bakewell
