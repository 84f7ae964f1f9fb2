#include "worker/gather/accumulate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

TEST(Accumulator, MeanAndShAreOverTheCountedSamples) {
  Accumulator sum;
  for (uint32_t i = 0; i < 16; ++i) {
    if (i == 3) continue;  // its point was inside other geometry
    sum.Count();
    if (i % 2 == 0) continue;  // found nothing
    sum.AddIrradiance(i, 16, {1, 2, 4});
    sum.AddSh({0, 0, 1}, {1, 2, 4});
  }
  EXPECT_EQ(sum.count(), 15);
  EXPECT_NEAR(sum.Irradiance().y, 2 * 7.0 / 15, 1e-6);
  EXPECT_NEAR(sum.Sh().lambda[0].z, 4 * 0.282095 * 7 / 15, 1e-5);
  EXPECT_NEAR(sum.Sh().lambda[2].x, 0.488603 * 7 / 15, 1e-5);
  EXPECT_EQ(sum.Sh().lambda[3].x, 0);
}

// Two samples are two blocks, and the estimate goes on from there as if there had been more.
TEST(Accumulator, FewSamplesTellTheirVarianceToo) {
  TestRandom random(5);
  constexpr std::array<uint32_t, 4> kRounds{2, 4, 8, 16};
  std::array<double, kRounds.size()> estimated{}, spread{};
  constexpr int kSets = 4000;
  for (int set = 0; set < kSets; ++set) {
    Accumulator sum;
    for (size_t round = 0; round < kRounds.size(); ++round) {
      if (round > 0) sum.Double();
      for (uint32_t i = round > 0 ? kRounds[round - 1] : 0; i < kRounds[round]; ++i) {
        sum.Count();
        const auto value = static_cast<float>(random.Unit());
        sum.AddIrradiance(i, kRounds[round], {value, value, value});
      }
      estimated[round] += static_cast<double>(sum.Variance().x) / kSets;
      spread[round] += std::pow(static_cast<double>(sum.Irradiance().x) - 0.5, 2) / kSets;
      EXPECT_EQ(sum.blocks(), std::min(kRounds[round], 8U));
    }
  }
  // Of 4000 sets both have standard deviations of at most 2.3 %.
  for (size_t round = 0; round < kRounds.size(); ++round) {
    EXPECT_NEAR(spread[round] * 12 * kRounds[round], 1, 0.08) << kRounds[round];
    EXPECT_NEAR(estimated[round] * 12 * kRounds[round], 1, 0.08) << kRounds[round];
  }
}

TEST(Accumulator, NothingCountedIsZeroAndNotNan) {
  const Accumulator sum;
  EXPECT_EQ(sum.Irradiance(), (Rgb{0, 0, 0}));
  EXPECT_EQ(sum.Variance(), (Rgb{0, 0, 0}));
  EXPECT_EQ(sum.Sh().lambda[0], (Rgb{0, 0, 0}));
}

TEST(Accumulator, VarianceOfIndependentSamplesIsThatOfTheirMean) {
  // Exponential samples: mean 1, variance 1; the mean of n has 1/n. Each estimate has 7 degrees of freedom and a
  // kurtosis of its own: 4000 of them bring the relative error of their mean to about 1 %.
  TestRandom random(1);
  constexpr uint32_t n = 64;
  double variance = 0;
  for (int repeat = 0; repeat < 4000; ++repeat) {
    Accumulator sum;
    for (uint32_t i = 0; i < n; ++i) {
      sum.Count();
      sum.AddIrradiance(i, n, {-std::log(1 - random.Unit()), 0, 0});
    }
    variance += static_cast<double>(sum.Variance().x) / 4000;
  }
  EXPECT_NEAR(variance * n, 1, 0.03);
}

TEST(Accumulator, DoublingGivesWhatOneRoundWouldHave) {
  TestRandom random(2);
  std::vector<Rgb> samples;
  for (int i = 0; i < 128; ++i) samples.push_back({random.Unit(), random.Unit(), random.Unit()});
  Accumulator rounds, once;
  uint32_t done = 0;
  for (uint32_t planned = 16; planned <= 128; planned *= 2) {
    if (done > 0) rounds.Double();
    for (uint32_t i = done; i < planned; ++i) {
      rounds.Count();
      rounds.AddIrradiance(i, planned, samples[i]);
    }
    done = planned;
  }
  for (uint32_t i = 0; i < 128; ++i) {
    once.Count();
    once.AddIrradiance(i, 128, samples[i]);
  }
  // The order of additions differs: a few roundings of 2^-24.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(rounds.Irradiance()[c], once.Irradiance()[c], 1e-6);
    EXPECT_NEAR(rounds.Variance()[c] / once.Variance()[c], 1, 1e-3);
  }
}

}  // namespace
}  // namespace bakewell
