#include "worker/finish/ringing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/statistics.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

RadianceSh Lights(TestRandom& random, int count) {
  RadianceSh sh;
  for (int k = 0; k < count; ++k) {
    // Over the hemisphere around +Y, as a floor sees them.
    Vec3f up = UniformSphere({random.Unit(), random.Unit()});
    up.z = std::fabs(up.z);
    const auto basis = EvaluateSh({up.x, up.z, up.y});
    const Rgb light{random.Unit(), random.Unit() * random.Unit(), 1.0f};
    for (size_t i = 0; i < kShCoefficients; ++i) sh.lambda[i] += light * basis[i];
  }
  return sh;
}

// The least of all channels' least irradiance over their means, over normals all round.
double LeastOverMean(const RadianceSh& sh) {
  double least = 1e30;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f n = UniformSphere({(static_cast<float>(i) + 0.5f) / 20000,
                                   static_cast<float>(i) * 0.618034f - std::floor(static_cast<float>(i) * 0.618034f)});
    const Rgb e = IrradianceFromSh(sh, n);
    for (int c = 0; c < 3; ++c) {
      const float mean = kCosineLobe[0] * 0.28209479f * sh.lambda[0][c];
      if (mean > 0) least = std::min(least, static_cast<double>(e[c] / mean));
    }
  }
  return least;
}

double WindowStrength(const RadianceSh& sh) {
  const RadianceSh* const one = &sh;
  return WindowStrengths({&one, 1})[0];
}

TEST(Ringing, OneLightRingsBySixteenPercentAndNoMoreThanOneWhenWindowed) {
  TestRandom random(1);
  const RadianceSh sh = Lights(random, 1);
  EXPECT_NEAR(LeastOverMean(sh), -0.158, 0.002);
  EXPECT_NEAR(LeastOverMean(Windowed(sh, WindowStrength(sh))), -kMostRinging, 0.12 * kMostRinging);
}

TEST(Ringing, AnyLightsStayAboveMinusOnePercentWithTheWeakestWindowThatDoes) {
  TestRandom random(2);
  int windowed = 0;
  for (int k = 0; k < 500; ++k) {
    const RadianceSh sh = Lights(random, 1 + k % 40);
    const double strength = WindowStrength(sh), least = LeastOverMean(Windowed(sh, strength));
    EXPECT_GE(least, -kMostRinging - 2e-4) << k;
    if (strength == 0) continue;
    ++windowed;
    EXPECT_LE(least, -0.88 * kMostRinging) << k << ": a weaker window would have done";
  }
  EXPECT_GT(windowed, 100);
  EXPECT_LT(windowed, 500);
}

// What the search might stumble over: double eigenvalues, bands of nothing, black channels, any scale, no light at all
// that could be so.
RadianceSh Odd(TestRandom& random, int kind) {
  RadianceSh sh = Lights(random, kind % 2 == 0 ? 1 : 2);
  const auto each = [&](int begin, int end, auto change) {
    for (int i = begin; i < end; ++i) sh.lambda[static_cast<size_t>(i)] = change(sh.lambda[static_cast<size_t>(i)]);
  };
  const auto none = [](Rgb) { return Rgb{}; };
  switch (kind) {
    case 0:
    case 1: {
      const auto along = EvaluateSh({0, 0, kind == 0 ? 1.0f : -1.0f});
      for (size_t i = 0; i < kShCoefficients; ++i) sh.lambda[i] = Rgb{1, 1, 1} * along[i];
      break;
    }
    case 2:
      each(1, 4, none);
      break;
    case 3:
      each(4, 9, none);
      break;
    case 4:
      each(0, 9, [](Rgb one) { return Rgb{one.x, 0, 0}; });
      break;
    case 5:
    case 6:
      each(0, 9, [&](Rgb one) { return one * (kind == 5 ? 1e-28f : 1e28f); });
      break;
    default:
      each(1, 9, [&](Rgb one) { return one * std::pow(10.0f, 4 * random.Unit()); });
  }
  return sh;
}

TEST(Ringing, OddLightsToo) {
  TestRandom random(3);
  for (int k = 0; k < 160; ++k) {
    const RadianceSh sh = Odd(random, k % 8);
    const double strength = WindowStrength(sh), least = LeastOverMean(Windowed(sh, strength));
    EXPECT_GE(least, -kMostRinging - 2e-4) << k;
    if (strength > 0) {
      EXPECT_LE(least, -0.88 * kMostRinging) << k << ": a weaker window would have done";
    }
  }
}

TEST(Ringing, ATexelsWindowDoesNotDependOnThoseBesideIt) {
  TestRandom random(4);
  std::array<RadianceSh, kRingingLanes> sh;
  std::array<const RadianceSh*, kRingingLanes> batch;
  for (size_t k = 0; k < kRingingLanes; ++k) {
    sh[k] = k % 2 == 0 ? Lights(random, 1 + static_cast<int>(k)) : Odd(random, static_cast<int>(k));
    batch[k] = &sh[k];
  }
  for (size_t turn = 0; turn < kRingingLanes; ++turn) {
    const auto together = WindowStrengths(batch);
    for (size_t k = 0; k < kRingingLanes; ++k) EXPECT_EQ(WindowStrength(*batch[k]), together[k]) << turn << ", " << k;
    std::rotate(batch.begin(), batch.begin() + 1, batch.end());
  }
}

TEST(Ringing, AnEvenSkyAndNothingAtAllStayAsTheyAre) {
  RadianceSh sky;
  sky.lambda[0] = Rgb{1.772454f, 1.772454f, 1.772454f};
  sky.lambda[1] = Rgb{1.534990f, 1.534990f, 1.534990f};
  EXPECT_EQ(WindowStrength(sky), 0);
  EXPECT_EQ(WindowStrength({}), 0);
}

}  // namespace
}  // namespace bakewell
