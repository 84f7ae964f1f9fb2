#include "worker/texel/sampler.h"

#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "worker/texel/raster.h"

namespace bakewell {
namespace {

constexpr int kPage = 4, kSub = 8;

// A right triangle with legs of 3.75 m along +x and -z, a texel a metre: page (x, y) is world (x, 0, -y).
Scene HalfPage() {
  SceneBuilder builder({kPage, kPage});
  builder.AddTriangle({0, 0, 0}, {3.75, 0, 0}, {0, 0, -3.75}, {.page = {0, 0, 3.75f, 3.75f}});
  return builder.Build();
}

// The part of the triangle in a square of the page.
double AreaIn(Vec2d corner, double side) {
  return std::fabs(ClipToSquare({3, {Vec2d{0, 0}, {3.75, 0}, {0, 3.75}}}, corner, side).SignedArea());
}

// z-score of points against the uniform density over the part of the texel's footprint that is covered.
double Uniformity(const PreparedLevel& prepared, const Texel& texel, double footprint) {
  const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  const Vec3d origin = prepared.level->scene.origin_ws;
  const Vec2d corner{texel.x + 0.5 - footprint / 2, texel.y + 0.5 - footprint / 2};
  const double covered = AreaIn(corner, footprint);
  constexpr int n = 40000;
  std::vector<double> observed(kSub * kSub, 0.0), expected;
  TestRandom random(1);
  for (int i = 0; i < n; ++i) {
    const TexelPoint point = sampler.At(random.Square());
    const Vec3d p = ToDouble(point.surface.position) + origin;
    EXPECT_TRUE(point.valid);
    EXPECT_NEAR(p.y, 0, 1e-6);
    EXPECT_LE(p.x - p.z, 3.75 + 1e-5);
    const double x = (p.x - corner.x) / footprint, y = (-p.z - corner.y) / footprint;
    EXPECT_GE(std::min(x, y), -1e-5);
    EXPECT_LE(std::max(x, y), 1 + 1e-5);
    const int column = std::clamp(static_cast<int>(x * kSub), 0, kSub - 1);
    const int row = std::clamp(static_cast<int>(y * kSub), 0, kSub - 1);
    observed[static_cast<size_t>(row * kSub + column)] += 1;
  }
  for (int i = 0; i < kSub * kSub; ++i) {
    const double side = footprint / kSub;
    const Vec2d cell = corner + Vec2d{(i % kSub) * side, (i / kSub) * side};
    expected.push_back(n * AreaIn(cell, side) / covered);
  }
  return ChiSquareOf(observed, expected).Z();
}

TEST(TexelSampler, PointsAreUniformOverTheCoveredFootprint) {
  for (const float footprint : {0.5f, 1.0f}) {
    BakeSettings settings;
    settings.footprint = footprint;
    const PreparedLevel prepared = PrepareInMemory(HalfPage(), settings);
    int cut = 0;
    for (const Texel& texel : prepared.texels.texels) {
      cut += texel.coverage < 0.9f ? 1 : 0;
      EXPECT_LT(Uniformity(prepared, texel, static_cast<double>(footprint)), 4) << texel.x << " " << texel.y;
    }
    EXPECT_EQ(cut, 4);
  }
}

TEST(TexelSampler, PointsThatLeaveTheTriangleUnderTheCentreAreMirroredIntoIt) {
  BakeSettings settings;
  settings.footprint = 1;
  const PreparedLevel prepared = PrepareInMemory(HalfPage(), settings);
  const Vec3d origin = prepared.level->scene.origin_ws;
  for (const Texel& texel : prepared.texels.texels) {
    if (texel.x + texel.y != 2) continue;
    const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
    TestRandom random(4);
    int inside = 0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
      const Vec3d p = ToDouble(sampler.AtMirrored(random.Square()).surface.position) + origin;
      EXPECT_NEAR(p.y, 0, 1e-6);
      EXPECT_LE(p.x - p.z, 3.75 + 1e-5);
      EXPECT_GE(std::min(p.x, -p.z), -1e-5);
      const double x = p.x - texel.x, y = -p.z - texel.y;
      inside += std::min(x, y) > -1e-5 && std::max(x, y) < 1 + 1e-5 ? 1 : 0;
    }
    // A corner of 1/32 of the square is folded in; it lands in the square again.
    EXPECT_EQ(inside, n) << texel.x << " " << texel.y;
  }
}

TEST(TexelSampler, FootprintWithoutSurfaceFallsBackToAllThatIsCovered) {
  SceneBuilder builder({4, 4});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {.page = {1, 1, 0.2f, 0.2f}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  ASSERT_EQ(prepared.texels.texels.size(), 1u);
  const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, prepared.texels.texels[0]);
  const Vec3d origin = prepared.level->scene.origin_ws;
  TestRandom random(2);
  Vec3d mean;
  for (int i = 0; i < 10000; ++i) {
    mean += (ToDouble(sampler.At(random.Square()).surface.position) + origin) / 10000.0;
  }
  EXPECT_LT(Length(mean - Vec3d{0.5, 0, -0.5}), 0.02);  // 5 standard deviations of a mean of 10,000
}

TEST(TexelSampler, FrameTurnsWithTheSurfacesUv) {
  const PreparedLevel prepared = PrepareInMemory(HalfPage(), {});
  const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, prepared.texels.texels[0]);
  const TexelPoint point = sampler.At({0.5f, 0.5f});
  EXPECT_LT(Length(point.frame.t - Vec3f{1, 0, 0}), 1e-6f);
  EXPECT_LT(Length(point.frame.n - Vec3f{0, 1, 0}), 1e-6f);
  EXPECT_NEAR(sampler.radius(), std::sqrt(0.5), 1e-6);
}

TEST(TexelSampler, MaskRulesOutItsSixteenths) {
  BakeSettings settings;
  settings.footprint = 1;
  const PreparedLevel prepared = PrepareInMemory(HalfPage(), settings);
  const Texel& texel = prepared.texels.texels[0];
  TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  sampler.set_valid_mask(0x00ff);  // the two rows of least y
  const Vec3d origin = prepared.level->scene.origin_ws;
  TestRandom random(3);
  for (int i = 0; i < 1000; ++i) {
    const TexelPoint point = sampler.At(random.Square());
    const double y = -(static_cast<double>(point.surface.position.z) + origin.z) - texel.y;
    EXPECT_TRUE(point.valid == (y < 0.5) || std::fabs(y - 0.5) < 1e-5) << y;
  }
}

}  // namespace
}  // namespace bakewell
