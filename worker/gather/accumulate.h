#pragma once

#include <array>
#include <cstdint>

#include "core/sh/sh.h"

namespace bakewell {

inline constexpr int kBlocks = 8;

// Sums of one estimator of one texel: irradiance and SH of the incident radiance, and the spread of the irradiance over
// eight blocks of consecutive samples. Samples come in rounds that double their number; Double() halves the resolution
// of the blocks so that eight always cover everything. Block means of one Sobol set repel one another, so that their
// spread overstates the error of the whole set: the estimate errs on the safe side.
class Accumulator {
 public:
  // A sample whose point was valid, whatever it found.
  void Count() { count_ += 1; }
  // Sample `index` of `planned` in all (a multiple of kBlocks) found this irradiance.
  void AddIrradiance(uint32_t index, uint32_t planned, Rgb irradiance) {
    block_[static_cast<size_t>(index) * kBlocks / planned] += irradiance;
  }
  void AddSh(Vec3f dir_ws, Rgb radiance_over_pdf) {
    const auto basis = EvaluateSh(dir_ws);
    for (size_t i = 0; i < kShCoefficients; ++i) sh_[i] += radiance_over_pdf * basis[i];
  }

  // Before a round that doubles the samples.
  void Double() {
    for (size_t b = 0; b < kBlocks / 2; ++b) block_[b] = block_[2 * b] + block_[2 * b + 1];
    for (size_t b = kBlocks / 2; b < kBlocks; ++b) block_[b] = {};
  }

  float count() const { return count_; }
  Rgb Irradiance() const {
    Rgb sum;
    for (const Rgb& b : block_) sum += b;
    return count_ > 0 ? sum / count_ : Rgb{};
  }
  RadianceSh Sh() const {
    RadianceSh sh;
    for (size_t i = 0; i < kShCoefficients && count_ > 0; ++i) sh.lambda[i] = sh_[i] / count_;
    return sh;
  }
  // Variance of Irradiance(), per channel, from the spread of the blocks.
  Rgb Variance() const {
    if (count_ <= 0) return {};
    const Rgb mean = Irradiance() * (count_ / kBlocks);
    Rgb sum;
    for (const Rgb& b : block_) sum += (b - mean) * (b - mean);
    return sum * (kBlocks / (count_ * count_ * (kBlocks - 1)));
  }

 private:
  float count_ = 0;
  std::array<Rgb, kBlocks> block_{};
  std::array<Rgb, kShCoefficients> sh_{};
};

}  // namespace bakewell
