#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "server/chart/mesh/surface.h"
#include "server/chart/mesh/weld.h"
#include "tests/unit/chart/shapes.h"

namespace bakewell::chart {
namespace {

// Every neighbour names the face back across the same two positions.
void ExpectConsistent(const Surface& surface) {
  for (uint32_t f = 0; f < surface.FaceCount(); ++f)
    for (int k = 0; k < 3; ++k) {
      const uint32_t g = surface.across[f][k];
      if (g == kNone) continue;
      const auto& back = surface.across[g];
      ASSERT_NE(std::find(back.begin(), back.end(), f), back.end()) << f << " " << k;
    }
}

long Links(const Surface& surface) {
  long links = 0;
  for (const auto& across : surface.across) links += 3 - std::count(across.begin(), across.end(), kNone);
  return links / 2;
}

TEST(ChartWeld, NegativeZeroIsZero) {
  const std::vector<Vec3f> position{{0, 1, 2}, {-0.0f, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(WeldPositions(position), (std::vector<uint32_t>{0, 0, 2}));
}

TEST(ChartWeld, CopiesAreRankedWhateverTheirCornerOrder) {
  const std::vector<std::array<uint32_t, 3>> triangles{{0, 1, 2}, {2, 1, 0}, {1, 2, 3}, {1, 2, 0}};
  EXPECT_EQ(CopyRank(triangles), (std::vector<uint32_t>{0, 1, 0, 2}));
}

TEST(ChartSurface, BoxWithSplitVerticesIsClosed) {
  const Soup box = Box();
  const Surface surface = BuildSurface(box.position, box.index);
  EXPECT_EQ(surface.FaceCount(), 12u);
  EXPECT_EQ(Links(surface), 18);
  ExpectConsistent(surface);
}

TEST(ChartSurface, ThreeWingsAtAnEdgeJoinTheFlattestTwo) {
  const std::vector<Vec3f> position{{0, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {1, 0, 0.1f}, {0, 0, -1}};
  const std::vector<uint32_t> index{0, 1, 2, 1, 0, 3, 1, 0, 4};
  const Surface surface = BuildSurface(position, index);
  EXPECT_EQ(Links(surface), 1);
  EXPECT_EQ(surface.across[0][0], 1u);
  EXPECT_EQ(surface.across[2], (std::array<uint32_t, 3>{kNone, kNone, kNone}));
}

TEST(ChartSurface, DoubledMeshIsTwoLayers) {
  Soup box = Box();
  const std::vector<uint32_t> once = box.index;
  box.index.insert(box.index.end(), once.begin(), once.end());
  const Surface surface = BuildSurface(box.position, box.index);
  EXPECT_EQ(surface.FaceCount(), 24u);
  EXPECT_EQ(Links(surface), 36);
  ExpectConsistent(surface);
}

TEST(ChartSurface, DegenerateAndNonFiniteTrianglesAreSetAside) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vec3f> position{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {nan, 0, 0}};
  const std::vector<uint32_t> index{0, 1, 2, 0, 1, 3, 0, 0, 1, 0, 1, 4};
  const Surface surface = BuildSurface(position, index);
  EXPECT_EQ(surface.state, (std::vector<FaceState>{FaceState::kCharted, FaceState::kDegenerate, FaceState::kDegenerate,
                                                   FaceState::kNonFinite}));
  EXPECT_EQ(surface.source, std::vector<uint32_t>{0});
}

TEST(ChartSurface, HubOfManyTrianglesIsCutUp) {
  Soup fan;
  fan.position.push_back({0, 0, 0});
  const int spokes = 100000;
  for (int i = 0; i < spokes; ++i) {
    const double a = 2 * kPi * i / spokes;
    fan.position.push_back(ToFloat({std::cos(a), std::sin(a), 0}));
    fan.index.insert(fan.index.end(), {0u, uint32_t(i + 1), uint32_t((i + 1) % spokes + 1)});
  }
  const Surface surface = BuildSurface(fan.position, fan.index);
  EXPECT_EQ(surface.FaceCount(), 100000u);
  EXPECT_NEAR(double(Links(surface)), spokes * (1 - 1.0 / 256), 2);
}

}  // namespace
}  // namespace bakewell::chart
