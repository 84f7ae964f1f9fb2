#include "worker/texel/texels.h"

#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

// Overlap of [low, high) with texel [t, t + 1).
double Overlap(double low, double high, int t) {
  return std::max(0.0, std::min(high, t + 1.0) - std::max(low, static_cast<double>(t)));
}

TEST(RasterizeTexels, QuadHasExactCoverageAreaAndPosition) {
  SceneBuilder builder({8, 8});
  // 3.75 x 2.5 texels on 7.5 x 2.5 m: a texel is 2 x 1 m. Page corner (1.5, 2.25).
  builder.AddQuad({0, 0, 0}, {7.5, 0, 0}, {0, 0, -2.5}, {.page = {1.5f, 2.25f, 3.75f, 2.5f}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  const Vec3d origin = prepared.level->scene.origin_ws;
  ASSERT_EQ(prepared.texels.texels.size(), 5u * 3u);
  for (const Texel& texel : prepared.texels.texels) {
    const double w = Overlap(1.5, 5.25, texel.x), h = Overlap(2.25, 4.75, texel.y);
    EXPECT_NEAR(texel.coverage, w * h, 1e-6);
    EXPECT_NEAR(texel.area, w * h * 2, 1e-5);
    EXPECT_NEAR(texel.normal.y, 1, 1e-6);
    EXPECT_NEAR(texel.smooth_normal.y, 1, 1e-6);
    EXPECT_TRUE(texel.flat);
    const double x = std::max(1.5, double(texel.x)) + w / 2, y = std::max(2.25, double(texel.y)) + h / 2;
    const Vec3d expected{2 * (x - 1.5), 0, -(y - 2.25)};
    EXPECT_LT(Length(ToDouble(texel.position) + origin - expected), 1e-5) << texel.x << " " << texel.y;
  }
  EXPECT_EQ(prepared.texels.overlapping_texels, 0);
}

TEST(RasterizeTexels, AreasAddUpToTheSurfaces) {
  SceneBuilder builder({40, 24});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.page = {0, 0, 24.5f, 24}});
  builder.AddSphere({1.5, 1, 2}, 0.5, 12, {.page = {26, 1.25f, 13, 9}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  double surface = 0, area = 0, coverage = 0;
  for (const Triangle& t : prepared.world->triangles()) surface += 0.5 * static_cast<double>(Length(Cross(t.e1, t.e2)));
  for (const Texel& texel : prepared.texels.texels) {
    area += static_cast<double>(texel.area);
    coverage += static_cast<double>(texel.coverage);
  }
  EXPECT_NEAR(area / surface, 1, 1e-5);  // single precision sums
  // The sphere's chart lacks the triangles that collapse at the poles: half of the first and of the last row.
  EXPECT_NEAR(coverage, 24.5 * 24 + 13 * 9 * (1 - 1.0 / 12), 1e-3);
}

TEST(RasterizeTexels, FragmentsAndTilesIndexEveryTexelOnce) {
  SceneBuilder builder({40, 36});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.page = {0, 0, 40, 36}});
  const TexelMap map = PrepareInMemory(builder.Build(), {}).texels;
  ASSERT_EQ(map.tile_begin.front(), 0u);
  ASSERT_EQ(map.tile_begin.back(), map.texels.size());
  EXPECT_EQ(map.tile_count(), 9);
  uint32_t fragment = 0;
  for (int tile = 0; tile < map.tile_count(); ++tile) {
    for (uint32_t i = map.tile_begin[tile]; i < map.tile_begin[tile + 1]; ++i) {
      const Texel& texel = map.texels[i];
      EXPECT_EQ(texel.fragment_begin, fragment);
      fragment = texel.fragment_end;
      EXPECT_EQ(texel.x / kTileSide, map.texels[map.tile_begin[tile]].x / kTileSide);
      EXPECT_EQ(texel.y / kTileSide, map.texels[map.tile_begin[tile]].y / kTileSide);
      EXPECT_EQ(map.texel_at[0][static_cast<size_t>(texel.y * 40 + texel.x)], static_cast<int32_t>(i));
    }
  }
  EXPECT_EQ(fragment, map.fragments.size());
}

TEST(RasterizeTexels, OverlappingChartsAreCounted) {
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {.page = {0, 0, 4, 4}});
  builder.AddQuad({0, 1, 0}, {1, 0, 0}, {0, 0, -1}, {.page = {3, 0, 4, 4}});
  EXPECT_EQ(PrepareInMemory(builder.Build(), {}).texels.overlapping_texels, 4);
}

}  // namespace
}  // namespace bakewell
