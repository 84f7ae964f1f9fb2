#include "worker/filter/seams.h"

#include <gtest/gtest.h>

#include <chrono>
#include <map>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/slowness.h"
#include "worker/filter/connect.h"

namespace bakewell {
namespace {

constexpr int kSide = 8;  // of a floor, in metres and texels

// Two square floors of 8 x 8 m, the one from x = 0 to 8 and the other beyond, `rise` metres higher and turned about the
// line where they touch by so many that `fall` metres are lost on 8; the second has texels of 8 / side m.
SceneBuilder TwoFloors(double rise = 0, double fall = 0, float side = kSide) {
  SceneBuilder builder({64, 64});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {2, 2, kSide, kSide}});
  // Its chart lies turned on the page.
  builder.AddQuad({8, rise, -8}, {0, 0, 8}, {8, -fall, 0}, {.page = {20, 20, side, side}});
  return builder;
}

struct Found {
  TexelMap map;
  std::vector<Seam> seams;
  int64_t rays = 0;
};

Found SeamsIn(const SceneBuilder& builder, const std::vector<uint32_t>& invalid = {}, BakeSettings settings = {}) {
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), settings);
  Found found;
  found.map = prepared.texels;
  std::vector<bool> valid(found.map.texels.size(), true);
  for (const uint32_t texel : invalid) valid[texel] = false;
  std::vector<uint8_t> open;
  for (uint32_t i = 0; i < found.map.texels.size(); ++i) {
    open.push_back(ConnectTexel(*prepared.world, found.map, i, true, found.rays));
  }
  found.rays = 0;
  found.seams = FindSeams(*prepared.world, found.map, 0, valid, open, found.rays);
  return found;
}

TEST(FindSeams, FollowAFloorIntoItsNextPiece) {
  const Found found = SeamsIn(TwoFloors());
  EXPECT_EQ(found.seams.size(), 2u * kSide * (1 + kSeamReach));
  EXPECT_GT(found.rays, 0);
  for (const Seam& seam : found.seams) {
    const Texel &texel = found.map.texels[seam.texel], &other = found.map.texels[seam.other];
    EXPECT_NE(texel.chart, other.chart);
    EXPECT_NEAR(texel.position.z, other.position.z, 1e-4f);
    EXPECT_NEAR(seam.distance, Length(texel.position - other.position), 1e-3f);  // texels are 1 m wide
    EXPECT_LT(seam.distance, kSeamReach + 1.01f);
  }
}

TEST(FindSeams, AGentleBendIsOneSurface) {
  EXPECT_EQ(SeamsIn(TwoFloors(0, 1.5)).seams.size(), 2u * kSide * (1 + kSeamReach));
}

TEST(FindSeams, EndAtEdgesStepsAndOtherSizes) {
  EXPECT_TRUE(SeamsIn(TwoFloors(0, 8)).seams.empty());
  EXPECT_TRUE(SeamsIn(TwoFloors(0.6)).seams.empty());
  EXPECT_TRUE(SeamsIn(TwoFloors(0, 0, kSide / 4.0f)).seams.empty());
}

// Rays pass the back of what lies above.
TEST(FindSeams, EndAtStepsWithoutBacks) {
  BakeSettings settings;
  settings.backfaces = BackfaceMode::kPass;
  EXPECT_TRUE(SeamsIn(TwoFloors(0.6), {}, settings).seams.empty());
}

// Much thinner than a texel.
TEST(FindSeams, EndAtWalls) {
  SceneBuilder builder = TwoFloors();
  builder.AddBox({7.999, 0, -8}, {8.001, 3, 0}, {.lightmapped = false});
  const Found found = SeamsIn(builder);
  EXPECT_TRUE(found.seams.empty());
  EXPECT_GT(found.rays, 0);
}

TEST(FindSeams, LeaveOutInvalidTexels) {
  const uint32_t invalid = SeamsIn(TwoFloors()).seams.front().other;
  for (const Seam& seam : SeamsIn(TwoFloors(), {invalid}).seams) {
    EXPECT_NE(seam.texel, invalid);
    EXPECT_NE(seam.other, invalid);
  }
}

// Two thousand pieces upon each other: a second, where it took 43 while everybody looked
// at everybody.
TEST(FindSeams, PiecesUponEachOtherAreNotAllCompared) {
  Found one = SeamsIn(TwoFloors());
  constexpr int kCopies = 2000;
  TexelMap map = one.map;
  const auto texels = static_cast<uint32_t>(map.texels.size());
  map.pages[0] = {64, 64 * kCopies};
  map.texel_at[0].assign(size_t{64} * 64 * kCopies, -1);
  map.texels.clear();
  for (int copy = 0; copy < kCopies; ++copy) {
    for (uint32_t i = 0; i < texels; ++i) {
      Texel texel = one.map.texels[i];
      texel.y += 64 * copy;
      texel.chart += 2 * copy;
      map.texel_at[0][static_cast<size_t>(texel.y) * 64 + static_cast<size_t>(texel.x)] =
          static_cast<int32_t>(map.texels.size());
      map.texels.push_back(texel);
    }
  }
  const PreparedLevel prepared = PrepareInMemory(TwoFloors().Build(), {});
  int64_t rays = 0;
  const std::vector<bool> valid(map.texels.size(), true);
  const std::vector<uint8_t> open(map.texels.size(), 0);
  const auto start = std::chrono::steady_clock::now();
  FindSeams(*prepared.world, map, 0, valid, open, rays);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20) * test::kSlowness);
}

// Floors in a row: a texel that two others lie next to knows both, once each.
TEST(FindSeams, EveryChartCountsOnce) {
  SceneBuilder builder({64, 64});
  for (int k = 0; k < 3; ++k) {
    builder.AddQuad({2.0 * k, 0, 0}, {2, 0, 0}, {0, 0, -8}, {.page = {2.0f + 8.0f * static_cast<float>(k), 2, 2, 8}});
  }
  const Found found = SeamsIn(builder);
  std::map<uint32_t, std::map<int32_t, int>> of_texel;
  for (const Seam& seam : found.seams) ++of_texel[seam.texel][found.map.texels[seam.other].chart];
  EXPECT_EQ(of_texel.size(), found.map.texels.size());
  for (const auto& [texel, charts] : of_texel) {
    for (const auto& [chart, count] : charts) EXPECT_EQ(count, 1);
  }
}

}  // namespace
}  // namespace bakewell
