#include "worker/filter/similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kSide = 48;

// A page of connected texels that hold signal(x, y) and noise of a standard deviation, and what the filter makes of it.
class Page {
 public:
  Page(const std::function<float(int, int)>& signal, float deviation, uint32_t seed)
      : signal_(signal), deviation_(deviation) {
    TestRandom random(seed);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        // The sum of twelve uniform numbers has variance 1.
        float normal = -6;
        for (int i = 0; i < 12; ++i) normal += random.Unit();
        value_.push_back(signal(x, y) + deviation * normal);
        variance_.push_back(deviation * deviation);
      }
    }
  }

  float& Value(int x, int y) { return value_[Place(x, y)]; }
  float& Variance(int x, int y) { return variance_[Place(x, y)]; }

  const SimilarTexels& Weigh() {
    weights_.Clear();
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) weights_.Put(x, y, Value(x, y), Variance(x, y), 1);
    }
    weights_.Compare(false);
    weights_.Regress();
    return weights_;
  }
  float Smoothed(int x, int y) const { return weights_.MeanOf(x, y).value; }

  // Root mean square error after filtering over that before.
  double ErrorRatio() {
    Weigh();
    double after = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const double d = static_cast<double>(Smoothed(x, y) - signal_(x, y));
        after += d * d;
      }
    }
    return std::sqrt(after / (kSide * kSide)) / static_cast<double>(deviation_);
  }

 private:
  static size_t Place(int x, int y) { return static_cast<size_t>(y * kSide + x); }

  std::function<float(int, int)> signal_;
  float deviation_;
  std::vector<float> value_, variance_;
  SimilarTexels weights_{kSide, kSide};
};

TEST(SimilarTexels, FlatLightLosesItsNoise) {
  // Nearness alone would leave 0.12. As bright as floats allow, and as dim.
  for (const float deviation : {0.5f, 1e-9f, 1e9f}) {
    EXPECT_LT(Page([&](int, int) { return 6 * deviation; }, deviation, 1).ErrorRatio(), 0.2) << deviation;
  }
}

TEST(SimilarTexels, ASlopeIsKeptAndItsNoiseGoes) {
  const auto slope = [](int x, int y) { return 3 + 0.2f * static_cast<float>(x) - 0.1f * static_cast<float>(y); };
  EXPECT_LT(Page(slope, 0.5f, 1).ErrorRatio(), 0.3);
  EXPECT_LT(Page(slope, 0.1f, 1).ErrorRatio(), 0.6);
  EXPECT_LT(Page(slope, 0.01f, 1).ErrorRatio(), 1.0001);  // far more than noise from texel to texel: left alone
}

TEST(SimilarTexels, AnEdgeThatNoiseDoesNotHideStays) {
  const auto edge = [](int x, int) { return x < 20 ? 1.0f : 5.0f; };
  Page page(edge, 0.05f, 2);
  EXPECT_LT(page.ErrorRatio(), 0.3);
  for (int y = 0; y < kSide; ++y) {
    EXPECT_NEAR(page.Smoothed(19, y), 1, 0.15f) << y;
    EXPECT_NEAR(page.Smoothed(20, y), 5, 0.15f) << y;
  }
}

TEST(SimilarTexels, WithoutNoiseNothingChanges) {
  const auto bumps = [](int x, int y) {
    return 1 + std::sin(0.5f * static_cast<float>(x)) * std::cos(0.3f * static_cast<float>(y));
  };
  Page page(bumps, 0, 3);
  page.Weigh();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) EXPECT_EQ(page.Smoothed(x, y), bumps(x, y));
  }
}

TEST(SimilarTexels, WeightsAddUpToOne) {
  Page page([](int x, int y) { return 3 + 0.2f * static_cast<float>(x) - 0.1f * static_cast<float>(y); }, 0.5f, 4);
  const SimilarTexels& weights = page.Weigh();
  for (const int x : {0, 1, 5, 20, 47}) {
    double sum = 0, square = 0;
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        const auto w = static_cast<double>(weights.Weight(x, 3, dx, dy));
        if (x + dx < 0 || x + dx >= kSide || 3 + dy < 0) {
          EXPECT_EQ(w, 0);
        }
        sum += w;
        square += w * w;
      }
    }
    EXPECT_NEAR(sum, 1, 1e-5) << x;
    const SimilarTexels::Mean mean = weights.MeanOf(x, 3);
    EXPECT_GT(mean.follows, weights.Weight(x, 3, 0, 0));
    EXPECT_GT(static_cast<double>(mean.square), square);
    EXPECT_NEAR(mean.variance, 0.25f * mean.square, 1e-5f);
  }
}

// Over flat light, a slope and stripes: the variance and the bias that a page says of itself, against its error.
TEST(SimilarTexels, SaysItsError) {
  const std::vector<std::function<float(int, int)>> signals = {
      [](int, int) { return 3.0f; }, [](int x, int) { return 3 + 0.1f * static_cast<float>(x); },
      [](int x, int) { return x % 12 < 6 ? 3.0f : 3.5f; }};
  for (size_t s = 0; s < signals.size(); ++s) {
    double square = 0, variance = 0, bias = 0;
    constexpr int kSeeds = 10;
    for (uint32_t seed = 1; seed <= kSeeds; ++seed) {
      Page page(signals[s], 0.5f, seed);
      const SimilarTexels& weights = page.Weigh();
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const SimilarTexels::Mean mean = weights.MeanOf(x, y);
          const auto d = static_cast<double>(mean.value - signals[s](x, y));
          square += d * d / (kSide * kSide * kSeeds);
          variance += static_cast<double>(mean.variance) / (kSide * kSide * kSeeds);
          bias += static_cast<double>(mean.bias_square) / (kSide * kSide * kSeeds);
        }
      }
    }
    EXPECT_NEAR((variance + bias) / square, 1, 0.3) << s;
    if (s == 0) {
      EXPECT_NEAR(variance / square, 1, 0.2);
    }
  }
}

TEST(SimilarTexels, WhatIsCutOffHasNoWeight) {
  SimilarTexels weights(8, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) weights.Put(x, y, 1, 1, x < 4 ? 1 : 2);
  }
  weights.Compare(false);
  WindowSet cut;
  for (int dy = 1; dy <= kWindowRadius; ++dy) {
    for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) cut[WindowIndex(dx, dy)] = true;
  }
  weights.CutOff(2, 4, cut);
  weights.Regress();
  EXPECT_EQ(weights.Weight(3, 4, 1, 0), 0);  // another part
  EXPECT_GT(weights.Weight(3, 4, -1, 0), 0);
  for (int dx = -2; dx <= 1; ++dx) {
    EXPECT_EQ(weights.Weight(2, 4, dx, 1), 0) << dx;
    EXPECT_GT(weights.Weight(2, 4, dx, -1), 0) << dx;
    EXPECT_GT(weights.Weight(1, 4, dx, 1), dx == -2 ? -1.0f : 0.0f) << dx;
  }
}

// A page is weighed block by block.
TEST(SimilarTexels, BlocksGiveTheSameAsAWhole) {
  Page page([](int x, int) { return x < 20 ? 1.0f : 2.0f; }, 0.4f, 6);
  const SimilarTexels& whole = page.Weigh();
  constexpr int kBlock = 16;
  for (int top = 0; top < kSide; top += kBlock) {
    for (int left = 0; left < kSide; left += kBlock) {
      SimilarTexels block(kBlock, kBlock);
      for (int y = -SimilarTexels::kHalo; y < kBlock + SimilarTexels::kHalo; ++y) {
        for (int x = -SimilarTexels::kHalo; x < kBlock + SimilarTexels::kHalo; ++x) {
          if (left + x < 0 || top + y < 0 || left + x >= kSide || top + y >= kSide) continue;
          block.Put(x, y, page.Value(left + x, top + y), page.Variance(left + x, top + y), 1);
        }
      }
      block.Compare(true);
      block.Regress();
      for (int y = 0; y < kBlock; ++y) {
        for (int x = 0; x < kBlock; ++x) {
          for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
            for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
              ASSERT_EQ(block.Weight(x, y, dx, dy), whole.Weight(left + x, top + y, dx, dy));
            }
          }
        }
      }
    }
  }
}

TEST(SimilarTexels, AStrayTexelJoinsItsNeighbours) {
  Page page([](int, int) { return 1.0f; }, 0.1f, 5);
  page.Value(20, 20) = 1.4f;  // four standard errors
  page.Weigh();
  EXPECT_NEAR(page.Smoothed(20, 20), 1, 0.12f);
}

// Symptom: a dark texel in a corner among bright ones took its neighbours' light however little noise there was, which
// cost shelves of books (eight texels a metre) half their error at 2 %.
TEST(SimilarTexels, ADetailIsKept) {
  Page page([](int, int) { return 1.0f; }, 0.03f, 5);
  page.Value(20, 20) = 0.2f;  // 27 standard errors
  page.Weigh();
  EXPECT_NEAR(page.Smoothed(20, 20), 0.2f, 0.04f);
  EXPECT_NEAR(page.Smoothed(21, 20), 1, 0.1f);
}

// Symptom: of few samples, one in a few dozen texels met the bright doorway and said so itself (its blocks differ by
// all of it). Its quiet neighbours kept away from it, and it to itself: dim rooms were full of sparks.
TEST(SimilarTexels, SparksAreSpread) {
  Page page([](int, int) { return 1.0f; }, 0.1f, 5);
  int sparks = 0;
  for (int y = 3; y < kSide; y += 6) {
    for (int x = 3; x < kSide; x += 6, ++sparks) {
      page.Value(x, y) += 4;
      page.Variance(x, y) = 16;
    }
  }
  page.Weigh();
  double sum = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      EXPECT_LT(page.Smoothed(x, y), 2.0f) << x << " " << y;
      sum += static_cast<double>(page.Smoothed(x, y)) - 1;
    }
  }
  EXPECT_GT(sum, 2 * sparks);  // their light is not thrown away; the chart's sum is the page filter's to keep
}

// What is no number, or far above what floats square, must not make anything else so.
TEST(SimilarTexels, EnormousValuesStayWhereTheyAre) {
  Page page([](int, int) { return 1.0f; }, 0.1f, 5);
  page.Value(20, 20) = 1e18f;
  page.Value(30, 30) = 3e38f;
  page.Weigh();
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if ((x != 20 || y != 20) && (x != 30 || y != 30)) {
        EXPECT_NEAR(page.Smoothed(x, y), 1, 0.5f) << x << " " << y;
      }
    }
  }
}

}  // namespace
}  // namespace bakewell
