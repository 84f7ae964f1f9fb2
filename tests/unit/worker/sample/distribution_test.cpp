#include "worker/sample/distribution.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr float kLast = 0x1.fffffep-1f;  // the largest u
const std::vector<float> kWeights = {0, 1, 0, 0, 3, 0.5f, 0, 2.5f, 0, 0};

TEST(Distribution1D, DrawsInProportionToWeights) {
  const Distribution1D distribution(kWeights);
  std::vector<double> observed(kWeights.size(), 0.0), expected, remainders(10, 0.0);
  constexpr int n = 200000;
  TestRandom random(1);
  for (int i = 0; i < n; ++i) {
    const auto sample = distribution.Draw(random.Unit());
    observed[sample.index] += 1;
    ASSERT_EQ(sample.probability, distribution.Probability(sample.index));
    remainders[static_cast<size_t>(sample.remainder * 10)] += 1;
  }
  double total = 0;
  for (size_t i = 0; i < kWeights.size(); ++i) {
    expected.push_back(n * static_cast<double>(kWeights[i]) / 7);
    total += static_cast<double>(distribution.Probability(static_cast<int>(i)));
    EXPECT_EQ(observed[i] > 0, kWeights[i] > 0) << i;
  }
  EXPECT_NEAR(total, 1, 1e-6);
  EXPECT_EQ(distribution.total(), 7);
  EXPECT_LT(ChiSquareOf(observed, expected).Z(), 4);
  EXPECT_LT(ChiSquareOf(remainders, std::vector<double>(10, n / 10.0)).Z(), 4);
}

TEST(Distribution1D, NeverDrawsAZeroWeightAtTheEnds) {
  const Distribution1D distribution(kWeights);
  for (const float u : {0.0f, 0x1p-24f, 1.0f / 7, 4.0f / 7, 4.5f / 7, 0.5f, kLast}) {
    const auto sample = distribution.Draw(u);
    EXPECT_GT(kWeights[sample.index], 0) << u;
    EXPECT_GE(sample.remainder, 0);
    EXPECT_LT(sample.remainder, 1);
  }
  EXPECT_EQ(distribution.Draw(0).index, 1);
  EXPECT_EQ(distribution.Draw(kLast).index, 7);
}

TEST(Distribution1D, SurvivesWeightsFarApart) {
  const std::vector<float> weights = {1e-30f, 1e30f, 1e-30f};
  const Distribution1D distribution(weights);
  EXPECT_EQ(distribution.Draw(0.5f).index, 1);
  for (const float u : {0.0f, 0.5f, kLast}) EXPECT_GT(distribution.Draw(u).probability, 0);
}

// Whatever may be drawn is known to be as likely as it is drawn, and what has weight may be.
TEST(Distribution1D, LosesNoWeightAndCountsAllThatItDraws) {
  for (const std::vector<float>& weights :
       {std::vector<float>{1e30f, 1e-30f, 0, 1e-30f}, {0, 1e-38f, 0}, {1, 0x1p-31f, 0x1p-33f, 0, 0x1p-40f, 0x1p-40f}}) {
    const Distribution1D distribution(weights);
    double sum = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
      const auto probability = static_cast<double>(distribution.Probability(static_cast<int>(i)));
      EXPECT_EQ(probability > 0, weights[i] > 0) << i;
      sum += probability;
    }
    EXPECT_NEAR(sum, 1, 1e-7);
    EXPECT_EQ(distribution.size(), static_cast<int>(weights.size()));
  }
  const Distribution1D distribution(std::vector<float>{1e-30f, 1, 0});
  EXPECT_EQ(distribution.Draw(0).index, 0);
  EXPECT_EQ(distribution.Draw(0).probability, 0x1p-32f);
  EXPECT_EQ(distribution.Draw(0x1p-32f).index, 1);
}

TEST(Distribution1D, AllZeroIsUniform) {
  const Distribution1D distribution(std::vector<float>(4, 0.0f));
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(distribution.Probability(i), 0.25f);
    EXPECT_EQ(distribution.Draw((static_cast<float>(i) + 0.5f) / 4).index, i);
  }
}

TEST(Distribution2D, DrawsInProportionToWeightsUniformlyInCells) {
  constexpr int w = 5, h = 4, n = 200000;
  std::vector<float> weights;
  TestRandom random(2);
  for (int i = 0; i < w * h; ++i) weights.push_back(i % 3 == 0 ? 0.0f : random.Unit());
  for (int x = 0; x < w; ++x) weights[static_cast<size_t>(2 * w + x)] = 0;  // a whole row
  double sum = 0;
  for (const float weight : weights) sum += static_cast<double>(weight);
  const Distribution2D distribution(w, h, weights);
  std::vector<double> observed(w * h, 0.0), expected;
  for (int i = 0; i < n; ++i) {
    const auto sample = distribution.Draw(random.Square());
    ASSERT_EQ(static_cast<int>(sample.position.x * w), sample.x);
    ASSERT_EQ(static_cast<int>(sample.position.y * h), sample.y);
    ASSERT_EQ(sample.pdf, distribution.Pdf(sample.x, sample.y));
    observed[static_cast<size_t>(sample.y * w + sample.x)] += 1;
  }
  double integral = 0;
  for (int i = 0; i < w * h; ++i) {
    expected.push_back(n * static_cast<double>(weights[i]) / sum);
    integral += static_cast<double>(distribution.Pdf(i % w, i / w)) / (w * h);
    EXPECT_EQ(observed[i] > 0, weights[i] > 0);
    EXPECT_NEAR(distribution.Pdf(i % w, i / w) / (w * h), static_cast<double>(weights[i]) / sum, 1e-6);
  }
  EXPECT_NEAR(integral, 1, 1e-6);
  EXPECT_LT(ChiSquareOf(observed, expected).Z(), 4);
}

// Finite weights whose rows add up to more than a float holds.
TEST(Distribution2D, SurvivesTheLargestWeights) {
  const Distribution2D distribution(2, 2, std::vector<float>(4, 3e38f));
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(distribution.Pdf(i % 2, i / 2), 1, 1e-6f);
}

TEST(Distribution1D, ManyCellsAreFoundAsIfSearchedOneByOne) {
  TestRandom random(3);
  for (const size_t cells : {17, 64, 1000, 70000}) {
    std::vector<float> weights;
    for (size_t i = 0; i < cells; ++i) weights.push_back(std::pow(random.Unit(), 8.0f) * (i % 3 == 0 ? 0.0f : 1.0f));
    const Distribution1D distribution(weights);
    for (int k = 0; k < 4096; ++k) {
      const float u = k == 4095 ? kLast : static_cast<float>(k) / 4096;
      const auto sample = distribution.Draw(u);
      double before = 0;
      for (int i = 0; i < sample.index; ++i) before += static_cast<double>(distribution.Probability(i));
      EXPECT_NEAR(before + static_cast<double>(sample.remainder * sample.probability), static_cast<double>(u), 2e-5);
      EXPECT_GT(weights[static_cast<size_t>(sample.index)], 0);
    }
  }
}

}  // namespace
}  // namespace bakewell
