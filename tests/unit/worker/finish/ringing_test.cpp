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
      least = std::min(least, static_cast<double>(e[c] / mean));
    }
  }
  return least;
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

TEST(Ringing, AnEvenSkyAndNothingAtAllStayAsTheyAre) {
  RadianceSh sky;
  sky.lambda[0] = Rgb{1.772454f, 1.772454f, 1.772454f};
  sky.lambda[1] = Rgb{1.534990f, 1.534990f, 1.534990f};
  EXPECT_EQ(WindowStrength(sky), 0);
  EXPECT_EQ(WindowStrength({}), 0);
}

}  // namespace
}  // namespace bakewell
