#include "worker/light/environment.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

Environment RandomMap(int width, int height) {
  Environment map;
  map.type = EnvironmentType::kLatLong;
  map.width = width;
  map.height = height;
  TestRandom random(1);
  for (int i = 0; i < width * height; ++i) {
    const float value = i % 3 == 0 ? 0.0f : random.Unit();
    map.latlong.push_back({value, value * value, value});
  }
  return map;
}

Environment Gradient() {
  Environment sky;
  sky.type = EnvironmentType::kGradient;
  sky.zenith = {4, 4, 4};
  sky.horizon = {1, 1, 1};
  return sky;
}

void ExpectDrawMatchesPdf(const Environment& environment) {
  const EnvironmentLight light(environment);
  const int w = light.width(), h = light.height();
  constexpr int n = 200000;
  std::vector<double> observed(static_cast<size_t>(w * h), 0.0), expected;
  double integral = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const double share = static_cast<double>(light.Pdf(light.CellCenter(x, y)) * light.CellSolidAngle(y));
      expected.push_back(share * n);
      integral += share;
    }
  }
  EXPECT_NEAR(integral, 1, 1e-5);
  TestRandom random(2);
  int other_pdf = 0;
  for (int i = 0; i < n; ++i) {
    const auto sample = light.Draw(random.Square());
    ASSERT_NEAR(Dot(sample.dir, sample.dir), 1, 1e-5);
    other_pdf += std::fabs(light.Pdf(sample.dir) - sample.pdf) > 1e-4f * sample.pdf ? 1 : 0;
    const double phi = std::atan2(static_cast<double>(sample.dir.z), static_cast<double>(sample.dir.x)) / (2 * kPi);
    const double theta = std::acos(std::clamp(static_cast<double>(sample.dir.y), -1.0, 1.0)) / kPi;
    const int x = std::clamp(static_cast<int>((phi < 0 ? phi + 1 : phi) * w), 0, w - 1);
    const int y = std::clamp(static_cast<int>(theta * h), 0, h - 1);
    observed[static_cast<size_t>(y * w + x)] += 1;
  }
  EXPECT_LT(ChiSquareOf(observed, expected).Z(), 4);
  // Directions within rounding of a cell's edge may fall to the other cell: at most 64 edges of 1e-6.
  EXPECT_LT(other_pdf, n / 5000);
}

TEST(EnvironmentLight, LatLongDrawsByItsPdf) { ExpectDrawMatchesPdf(RandomMap(16, 8)); }
TEST(EnvironmentLight, GradientDrawsByItsPdf) { ExpectDrawMatchesPdf(Gradient()); }

TEST(EnvironmentLight, FluenceIsTheIntegralOfRadiance) {
  Environment constant;
  constant.type = EnvironmentType::kConstant;
  constant.radiance = {1, 2, 3};
  EXPECT_NEAR(EnvironmentLight(constant).Fluence().y, 8 * kPi, 1e-4);
  // integral of 1 + 3 y over the upper hemisphere = 2 pi (1 + 3/2); cell centres are off by O(1/32^2).
  EXPECT_NEAR(EnvironmentLight(Gradient()).Fluence().y / (5 * kPi), 1, 1e-3);
}

TEST(EnvironmentLight, DarkSkyIsNotBright) {
  EXPECT_FALSE(EnvironmentLight(Environment{}).bright());
  Environment black = RandomMap(4, 2);
  for (Rgb& radiance : black.latlong) radiance = {};
  EXPECT_FALSE(EnvironmentLight(black).bright());
  EXPECT_TRUE(EnvironmentLight(RandomMap(4, 2)).bright());
}

TEST(EnvironmentLight, LatLongRowZeroIsUpAndColumnsGoFromXToZ) {
  Environment map = RandomMap(4, 2);
  for (size_t i = 0; i < 8; ++i) map.latlong[i] = {static_cast<float>(i), 0, 0};
  const EnvironmentLight light(map);
  EXPECT_EQ(light.Radiance(NormalizeOrZero(Vec3f{1, 1, 0.1f})).x, 0);
  EXPECT_EQ(light.Radiance(NormalizeOrZero(Vec3f{-0.1f, 1, 1})).x, 1);
  EXPECT_EQ(light.Radiance(NormalizeOrZero(Vec3f{1, -1, -0.1f})).x, 7);
}

}  // namespace
}  // namespace bakewell
