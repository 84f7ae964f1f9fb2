#include "worker/gather/noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/statistics.h"
#include "worker/sample/sobol.h"

namespace bakewell {
namespace {

using Sampled = std::function<double(Vec2f)>;

// True variance of the mean of `samples` points, over what the corrected estimate says: sets of one tile, keyed apart.
// Of light of a colour, its red.
double TrueOverEstimated(const Sampled& sampled, double mean, uint32_t samples, bool sobol, Rgb colour = {1, 1, 1}) {
  constexpr int kSets = 1024;
  TestRandom random(7);
  SetNoise noise;
  double square = 0, estimated = 0;
  for (uint32_t k = 0; k < kSets; ++k) {
    const SobolSet set(HashCombine(11, k));
    Accumulator sum;
    for (uint32_t i = 0; i < samples; ++i) {
      sum.Count();
      const Vec2f u = sobol ? set.At(i).Get2(0) : Vec2f{random.Unit(), random.Unit()};
      const float value = static_cast<float>(sampled(u));
      sum.AddIrradiance(i, samples, colour * value);
    }
    noise.Add(sum, 1);
    square += std::pow(static_cast<double>(sum.Irradiance().x) - mean, 2) / kSets;
    estimated += static_cast<double>(sum.Variance().x) / kSets;
  }
  return square / (estimated * static_cast<double>(noise.Correction()));
}

double Disc(Vec2f u) { return (u.x - 0.4f) * (u.x - 0.4f) + (u.y - 0.5f) * (u.y - 0.5f) < 0.09f ? 1 : 0; }
constexpr double kDisc = 0.09 * 3.14159265358979;

TEST(SetNoise, IsWhatItSaysForIndependentSamples) { EXPECT_NEAR(TrueOverEstimated(Disc, kDisc, 64, false), 1, 0.15); }

// The edge of a shadow: the whole set is better than its blocks say, and the estimate is within a third of the truth.
TEST(SetNoise, IsAboutRightForSobolSetsOverAnEdge) {
  for (const uint32_t samples : {64u, 256u}) {
    const double ratio = TrueOverEstimated(Disc, kDisc, samples, true);
    EXPECT_GT(ratio, 0.6) << samples;
    EXPECT_LT(ratio, 1.35) << samples;
  }
}

// A correction by luminance must not take a red lamp's errors for a white one's.
TEST(SetNoise, IsTheSameForColouredLight) {
  const double white = TrueOverEstimated(Disc, kDisc, 64, true);
  for (const Rgb colour : {Rgb{1, 0, 0}, Rgb{1, 0, 0.3f}, Rgb{1, 0.2f, 3}}) {
    EXPECT_NEAR(TrueOverEstimated(Disc, kDisc, 64, true, colour), white, 1e-4);
  }
}

// Smooth light: the variance falls much faster than any estimate from blocks may follow; it errs on the safe side.
TEST(SetNoise, ErrsOnTheSafeSideOverSmoothLight) {
  const auto slope = [](Vec2f u) { return static_cast<double>(u.x + 0.5f * u.y); };
  EXPECT_LT(TrueOverEstimated(slope, 0.75, 64, true), 1);
}

TEST(SetNoise, WithoutSetsLeavesVariancesAlone) {
  SetNoise noise;
  EXPECT_EQ(noise.Correction(), 1);
  noise.Add(Accumulator(), 1);
  noise.Add(Accumulator(), 0);
  EXPECT_EQ(noise.Correction(), 1);
}

}  // namespace
}  // namespace bakewell
