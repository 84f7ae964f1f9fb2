#include "worker/sample/warp.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kSamples = 200000;

// Directions against a pdf per steradian that depends on z alone: 16 bins of z in [low_z, 1] by 16 of azimuth.
double DirectionZ(const std::function<Vec3f(Vec2f)>& sampler, const std::function<double(double)>& pdf, double low_z) {
  constexpr int n = 16;
  std::vector<double> observed(n * n, 0.0), expected(n * n, 0.0);
  TestRandom random(1);
  for (int i = 0; i < kSamples; ++i) {
    const Vec3f d = sampler(random.Square());
    EXPECT_NEAR(Dot(d, d), 1, 1e-5);
    const double phi = std::atan2(static_cast<double>(d.y), static_cast<double>(d.x)) / (2 * kPi);
    const int column = std::clamp(static_cast<int>((phi < 0 ? phi + 1 : phi) * n), 0, n - 1);
    const int row = std::clamp(static_cast<int>((static_cast<double>(d.z) - low_z) / (1 - low_z) * n), 0, n - 1);
    observed[static_cast<size_t>(row * n + column)] += 1;
  }
  double total = 0;
  for (int row = 0; row < n; ++row) {
    double mean = 0;  // of the pdf, which is linear in z: the midpoint rule is exact
    for (int k = 0; k < 8; ++k) mean += pdf(low_z + (1 - low_z) * (row + (k + 0.5) / 8) / n) / 8;
    const double share = mean * (1 - low_z) / n * 2 * kPi / n;
    for (int column = 0; column < n; ++column) expected[static_cast<size_t>(row * n + column)] = share * kSamples;
    total += share * n;
  }
  EXPECT_NEAR(total, 1, 1e-6);  // the pdf integrates to one (it is single precision)
  return ChiSquareOf(observed, expected).Z();
}

TEST(Warp, GatherHemisphereFollowsGatherPdf) {
  EXPECT_LT(DirectionZ(
                GatherHemisphere, [](double z) { return static_cast<double>(GatherPdf(static_cast<float>(z))); }, 0),
            4);
}
TEST(Warp, CosineHemisphereFollowsTheCosine) {
  EXPECT_LT(DirectionZ(
                CosineHemisphere, [](double z) { return z / kPi; }, 0),
            4);
}
TEST(Warp, UniformSphereIsUniform) {
  EXPECT_LT(DirectionZ(
                UniformSphere, [](double) { return 1 / (4 * kPi); }, -1),
            4);
}

TEST(Warp, DirectionsStayOnTheirHemisphereAtTheCornersOfTheSquare) {
  const float last = 0x1.fffffep-1f;
  for (const Vec2f u : {Vec2f{0, 0}, Vec2f{last, 0}, Vec2f{0, last}, Vec2f{last, last}, Vec2f{0.5f, 0.5f}}) {
    for (const Vec3f d : {CosineHemisphere(u), GatherHemisphere(u)}) {
      EXPECT_GE(d.z, 0);
      EXPECT_NEAR(Dot(d, d), 1, 1e-5);
    }
  }
}

TEST(Warp, DiscIsUniform) {
  std::vector<double> observed(256, 0.0);
  const std::vector<double> expected(256, kSamples / 256.0);
  TestRandom random(2);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2f p = DiscFromSquare(random.Square());
    const double r2 = static_cast<double>(p.x * p.x + p.y * p.y);
    ASSERT_LE(r2, 1 + 1e-6);
    const double phi = (std::atan2(static_cast<double>(p.y), static_cast<double>(p.x)) + kPi) / (2 * kPi);
    const int row = std::min(15, static_cast<int>(r2 * 16)), column = std::min(15, static_cast<int>(phi * 16));
    observed[static_cast<size_t>(16 * row + column)] += 1;
  }
  EXPECT_LT(ChiSquareOf(observed, expected).Z(), 4);
}

TEST(Warp, TriangleIsUniform) {
  // 64 congruent triangles: cells of an 8 x 8 grid, those below the diagonal cut in two.
  std::vector<double> observed(128, 0.0), expected(128, 0.0);
  TestRandom random(3);
  for (int i = 0; i < kSamples; ++i) {
    const Vec2f b = TriangleFromSquare(random.Square());
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    ASSERT_LE(b.x + b.y, 1 + 1e-6f);
    const int x = std::min(7, static_cast<int>(b.x * 8)), y = std::min(7, static_cast<int>(b.y * 8));
    const bool upper = b.x * 8 - static_cast<float>(x) + b.y * 8 - static_cast<float>(y) > 1 && x + y < 7;
    observed[static_cast<size_t>(2 * (8 * x + y) + (upper ? 1 : 0))] += 1;
  }
  for (int x = 0; x < 8; ++x) {
    for (int y = 0; x + y < 8; ++y) {
      expected[static_cast<size_t>(2 * (8 * x + y))] = kSamples / 64.0;
      if (x + y < 7) expected[static_cast<size_t>(2 * (8 * x + y) + 1)] = kSamples / 64.0;
    }
  }
  EXPECT_LT(ChiSquareOf(observed, expected).Z(), 4);
}

TEST(Warp, SquareFromTriangleUndoesTriangleFromSquare) {
  TestRandom random(4);
  for (int i = 0; i < 10000; ++i) {
    Vec2f u = random.Square();
    if (i % 8 == 0) u.y = u.x;  // where the map is bent
    if (i % 8 == 1) u.x = 0;
    if (i % 8 == 2) u.y = 0;
    const Vec2f back = SquareFromTriangle(TriangleFromSquare(u));
    EXPECT_NEAR(back.x, u.x, 1e-7);
    EXPECT_NEAR(back.y, u.y, 1e-7);
  }
}

TEST(Circle, IsCosineAndSine) {
  for (int i = 0; i <= 4096; ++i) {
    const float turns = static_cast<float>(i) / 4096;
    const Vec2f p = Circle(turns);
    EXPECT_NEAR(static_cast<double>(p.x), std::cos(2 * kPi * static_cast<double>(turns)), 2e-7) << turns;
    EXPECT_NEAR(static_cast<double>(p.y), std::sin(2 * kPi * static_cast<double>(turns)), 2e-7) << turns;
  }
}

}  // namespace
}  // namespace bakewell
