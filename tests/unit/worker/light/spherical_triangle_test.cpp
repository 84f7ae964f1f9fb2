#include "worker/light/spherical_triangle.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

const Vec3f kX{1, 0, 0}, kY{0, 1, 0}, kZ{0, 0, 1};

TEST(SphericalTriangle, OctantsHaveAnEighthOfTheSphere) {
  for (const float sx : {-1.0f, 1.0f}) {
    for (const float sy : {-1.0f, 1.0f}) {
      for (const float sz : {-1.0f, 1.0f}) {
        EXPECT_NEAR(SphericalTriangle(kX * sx, kY * sy, kZ * sz).solid_angle(), kPi / 2, 1e-6);
      }
    }
  }
}

TEST(SphericalTriangle, WideAndFlatOnesHaveTheirSolidAngles) {
  // Three points 120 degrees apart on the equator's rim bound a hemisphere.
  const float c = -0.5f, s = std::sqrt(0.75f);
  EXPECT_NEAR(SphericalTriangle(kX, {c, s, 0}, {c, -s, 0}).solid_angle(), 2 * kPi, 1e-5);
  EXPECT_EQ(SphericalTriangle(kX, kY, kY).solid_angle(), 0);
  EXPECT_EQ(SphericalTriangle(kX, NormalizeOrZero(kX + kY), kY).solid_angle(), 0);
}

TEST(SphericalTriangle, OctantIsDrawnUniformly) {
  const SphericalTriangle octant(kX, kY, kZ);
  constexpr int n = 8, samples = 200000;
  std::vector<double> observed(n * n, 0.0);
  TestRandom random(1);
  for (int i = 0; i < samples; ++i) {
    const Vec3f d = octant.Draw(random.Square());
    ASSERT_NEAR(Dot(d, d), 1, 1e-5);
    ASSERT_GE(std::min(d.x, std::min(d.y, d.z)), -1e-6f);
    const double phi = std::atan2(static_cast<double>(d.y), static_cast<double>(d.x)) / (kPi / 2);
    const int row = std::clamp(static_cast<int>(d.z * n), 0, n - 1);
    const int column = std::clamp(static_cast<int>(phi * n), 0, n - 1);
    observed[static_cast<size_t>(row * n + column)] += 1;
  }
  EXPECT_LT(ChiSquareOf(observed, std::vector<double>(n * n, samples / double{n * n})).Z(), 4);
}

// Integral of the direction over the triangle: half the sum of edge angles times edge normals (Lambert's contour
// formula without the receiver).
Vec3d VectorIrradiance(Vec3f a, Vec3f b, Vec3f c) {
  const std::array<Vec3d, 3> p = {ToDouble(a), ToDouble(b), ToDouble(c)};
  Vec3d sum;
  for (size_t i = 0; i < 3; ++i) {
    const Vec3d cross = Cross(p[i], p[(i + 1) % 3]);
    const double angle = std::atan2(Length(cross), Dot(p[i], p[(i + 1) % 3]));
    sum += NormalizeOrZero(cross) * (0.5 * angle);
  }
  return Dot(sum, p[0] + p[1] + p[2]) < 0 ? -sum : sum;
}

TEST(SphericalTriangle, MeanDirectionIsVectorIrradianceOverSolidAngle) {
  TestRandom random(2);
  int tried = 0;
  while (tried < 40) {
    const Vec3f a = random.Direction();
    const float size = tried % 2 == 0 ? 1.0f : 0.3f;
    const Vec3f b = NormalizeOrZero(a + random.Direction() * size), c = NormalizeOrZero(a + random.Direction() * size);
    const SphericalTriangle triangle(a, b, c);
    if (triangle.solid_angle() < 0.01f) continue;  // smaller ones are drawn by area
    ++tried;
    // A 64 x 64 midpoint pattern: its error is far below that of the arithmetic, about 1e-4 for thin triangles.
    Vec3d mean;
    for (int i = 0; i < 4096; ++i) {
      mean +=
          ToDouble(triangle.Draw({(static_cast<float>(i % 64) + 0.5f) / 64, (static_cast<float>(i / 64) + 0.5f) / 64}));
    }
    mean = mean / 4096.0;
    const Vec3d expected = VectorIrradiance(a, b, c) / static_cast<double>(triangle.solid_angle());
    EXPECT_LT(Length(mean - expected), 1e-3) << "solid angle " << triangle.solid_angle();
  }
}

}  // namespace
}  // namespace bakewell
