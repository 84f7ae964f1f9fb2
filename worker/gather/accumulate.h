#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/sh/sh.h"

namespace bakewell {

inline constexpr int kBlocks = 8;
inline constexpr uint32_t kRun = 64;  // samples

// Samples are good up to here [W m^-2, W m^-2 sr^-1 times an inverse density]: the variance of a texel is a square.
inline constexpr float kBrightestSample = 1e18f;
inline bool IsGoodSample(Rgb sample) { return IsFinite(sample) && MaxComponent(sample) <= kBrightestSample; }

// Sums of one estimator of one texel: irradiance and SH of the incident radiance, and the spread of the irradiance over
// eight blocks of consecutive samples. Samples come in rounds that double their number; Double() halves the resolution
// of the blocks so that eight always cover everything. Block means of one Sobol set repel one another, so that their
// spread overstates the error of the whole set: the estimate errs on the safe side.
// Floats that are added to a million times are off in the second digit where the addends are alike (each is rounded the
// same way): runs of kRun samples are summed in float, the runs in double, which bounds the error by kRun 2^-24.
class Accumulator {
 public:
  // A sample whose point was valid, whatever it found.
  void Count() { count_ += 1; }
  // Sample `index` of `planned` in all (a multiple of kBlocks) found this irradiance. Samples come in order; a
  // run's irradiance ends with its block.
  void AddIrradiance(uint32_t index, uint32_t planned, Rgb irradiance) {
    planned_ = planned;
    const size_t block =
        planned <= static_cast<uint32_t>(kBlocks) ? index : static_cast<size_t>(index) * kBlocks / planned;
    if (++run_ > kRun) EndRun();
    if (block != run_block_) EndBlock(block);
    run_irradiance_ += irradiance;
  }
  void AddSh(Vec3f dir_ws, Rgb radiance_over_pdf) {
    const auto basis = EvaluateSh(dir_ws);
    for (size_t i = 0; i < kShCoefficients; ++i) run_sh_[i] += radiance_over_pdf * basis[i];
  }

  // Before a round that doubles the samples.
  void Double() {
    EndRun();
    EndBlock(0);
    if (planned_ < static_cast<uint32_t>(kBlocks)) return;
    for (size_t b = 0; b < kBlocks / 2; ++b) block_[b] = block_[2 * b] + block_[2 * b + 1];
    for (size_t b = kBlocks / 2; b < kBlocks; ++b) block_[b] = {};
  }

  size_t blocks() const { return std::min<size_t>(kBlocks, planned_); }
  float count() const { return static_cast<float>(count_); }
  Rgb Irradiance() const { return ToFloat(Mean()); }
  RadianceSh Sh() const {
    RadianceSh sh;
    for (size_t i = 0; i < kShCoefficients && count_ > 0; ++i)
      sh.lambda[i] = ToFloat((sh_[i] + ToDouble(run_sh_[i])) / count_);
    return sh;
  }
  // Variance of Irradiance(), per channel, if its blocks were independent.
  Rgb Variance() const {
    if (count_ <= 0) return {};
    const size_t blocks = this->blocks();
    if (blocks < 2) return ToFloat(Mean() * Mean());
    const auto n = static_cast<double>(blocks);
    const Vec3d mean = Mean() * (count_ / n);
    Vec3d sum;
    for (size_t b = 0; b < blocks; ++b) sum += (Block(b) - mean) * (Block(b) - mean);
    return ToFloat(sum * (n / (count_ * count_ * (n - 1))));
  }
  // Likewise of its luminance, whose channels need not err together.
  float LuminanceVariance() const {
    if (count_ <= 0) return 0;
    const size_t blocks = this->blocks();
    const auto luminance = [](Vec3d rgb) { return static_cast<double>(Luminance(ToFloat(rgb))); };
    if (blocks < 2) return static_cast<float>(luminance(Mean()) * luminance(Mean()));
    const auto n = static_cast<double>(blocks);
    const Vec3d mean = Mean() * (count_ / n);
    double sum = 0;
    for (size_t b = 0; b < blocks; ++b) sum += luminance(Block(b) - mean) * luminance(Block(b) - mean);
    return static_cast<float>(sum * (n / (count_ * count_ * (n - 1))));
  }
  // Mean squares of half the difference between the two halves (luminance): of the whole, of a half, of a quarter. Each
  // is what doubling the samples to that size took off the variance (1 : 2 : 4 for independent samples).
  std::array<double, 3> Halvings() const {
    std::array<double, 3> result{};
    if (count_ <= 0) return result;
    std::array<double, kBlocks> mean;
    for (size_t b = 0; b < kBlocks; ++b) {
      mean[b] = static_cast<double>(Luminance(ToFloat(Block(b) * (kBlocks / count_))));
    }
    size_t pairs = kBlocks / 2;
    for (size_t level = 3; level-- > 0; pairs /= 2) {
      for (size_t k = 0; k < pairs; ++k) {
        const double difference = 0.5 * (mean[2 * k] - mean[2 * k + 1]);
        result[level] += difference * difference / static_cast<double>(pairs);
        mean[k] = 0.5 * (mean[2 * k] + mean[2 * k + 1]);
      }
    }
    return result;
  }

 private:
  void EndBlock(size_t next_block) {
    block_[run_block_] += ToDouble(run_irradiance_);
    run_irradiance_ = {};
    run_block_ = next_block;
  }
  void EndRun() {
    EndBlock(run_block_);
    for (size_t i = 0; i < kShCoefficients; ++i) sh_[i] += ToDouble(run_sh_[i]);
    run_sh_ = {};
    run_ = 1;
  }
  Vec3d Block(size_t b) const { return b == run_block_ ? block_[b] + ToDouble(run_irradiance_) : block_[b]; }
  Vec3d Mean() const {
    Vec3d sum;
    for (size_t b = 0; b < kBlocks; ++b) sum += Block(b);
    return count_ > 0 ? sum / count_ : Vec3d{};
  }

  double count_ = 0;
  uint32_t planned_ = 0;
  std::array<Vec3d, kBlocks> block_{};
  std::array<Vec3d, kShCoefficients> sh_{};
  uint32_t run_ = 0;  // samples in the run
  size_t run_block_ = 0;
  Rgb run_irradiance_;
  std::array<Rgb, kShCoefficients> run_sh_{};
};

}  // namespace bakewell
