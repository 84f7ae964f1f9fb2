#include "worker/texel/raster.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kGrid = 8;

using Areas = std::map<std::pair<int, int>, double>;

Areas Rasterize(Vec2d a, Vec2d b, Vec2d c) {
  Areas areas;
  RasterizeExact(a, b, c, kGrid, kGrid, [&](int x, int y, const ConvexPolygon& part) {
    EXPECT_EQ(areas.count({x, y}), 0u) << "a cell comes once";
    areas[{x, y}] = std::fabs(part.SignedArea());
    for (int i = 0; i < part.count; ++i) {
      EXPECT_GE(part.corner[i].x, x - 1e-12);
      EXPECT_LE(part.corner[i].x, x + 1 + 1e-12);
      EXPECT_GE(part.corner[i].y, y - 1e-12);
      EXPECT_LE(part.corner[i].y, y + 1 + 1e-12);
    }
  });
  return areas;
}

double Total(const Areas& areas) {
  double total = 0;
  for (const auto& [cell, area] : areas) total += area;
  return total;
}

Vec2d Point(TestRandom& random, float low, float high) {
  const auto x = static_cast<double>(random.Between(low, high));
  return {x, static_cast<double>(random.Between(low, high))};
}

TEST(Raster, RightTriangleHasItsExactParts) {
  for (const bool flipped : {false, true}) {
    const Areas areas = flipped ? Rasterize({1, 1}, {1, 3}, {3, 1}) : Rasterize({1, 1}, {3, 1}, {1, 3});
    ASSERT_EQ(areas.size(), 3u);
    EXPECT_EQ(areas.at({1, 1}), 1);
    EXPECT_EQ(areas.at({2, 1}), 0.5);
    EXPECT_EQ(areas.at({1, 2}), 0.5);
  }
}

TEST(Raster, TriangleInsideOneCellAndWithoutArea) {
  const Areas one = Rasterize({2.25, 5.25}, {2.75, 5.25}, {2.25, 5.75});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one.at({2, 5}), 0.125);
  EXPECT_TRUE(Rasterize({1, 1}, {2, 2}, {3, 3}).empty());
  EXPECT_TRUE(Rasterize({1, 1}, {1, 1}, {3, 3}).empty());
  EXPECT_TRUE(Rasterize({-3, -1}, {-1, -1}, {-1, -3}).empty());
  EXPECT_TRUE(Rasterize({8, 0}, {9, 0}, {8, 3}).empty()) << "touches the border";
}

TEST(Raster, PartsOfRandomTrianglesAddUpToThem) {
  TestRandom random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vec2d a = Point(random, 0, kGrid), b = Point(random, 0, kGrid), c = Point(random, 0, kGrid);
    const double area = std::fabs(Cross(b - a, c - a)) / 2;
    EXPECT_NEAR(Total(Rasterize(a, b, c)), area, 1e-12 * kGrid * kGrid);
  }
}

TEST(Raster, PartsOfTrianglesThatLeaveTheGridAddUpToWhatIsInside) {
  TestRandom random(2);
  for (int i = 0; i < 2000; ++i) {
    const Vec2d a = Point(random, -8, 16), b = Point(random, -8, 16), c = Point(random, -8, 16);
    const double inside = std::fabs(ClipToSquare({3, {a, b, c}}, {0, 0}, kGrid).SignedArea());
    EXPECT_NEAR(Total(Rasterize(a, b, c)), inside, 1e-11 * kGrid * kGrid);
  }
}

TEST(Raster, TwoTrianglesOfAQuadShareTheirCellsExactly) {
  // Coordinates on the grid and its halves: nothing is rounded.
  Areas sum = Rasterize({0.5, 1}, {6, 1}, {6, 5.5});
  for (const auto& [cell, area] : Rasterize({0.5, 1}, {6, 5.5}, {0.5, 5.5})) sum[cell] += area;
  for (const auto& [cell, area] : sum) {
    const double expected = (cell.first == 0 ? 0.5 : 1) * (cell.second == 5 ? 0.5 : 1);
    EXPECT_NEAR(area, expected, 1e-13) << cell.first << " " << cell.second;
  }
  EXPECT_EQ(sum.size(), 30u);
}

}  // namespace
}  // namespace bakewell
