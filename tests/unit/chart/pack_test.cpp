#include <gtest/gtest.h>

#include <cmath>

#include "server/chart/pack/footprint.h"
#include "server/chart/pack/orient.h"
#include "server/chart/pack/page.h"

namespace bakewell::chart {
namespace {

std::vector<Segment2> Outline(const std::vector<Vec2d>& points) {
  std::vector<Segment2> outline;
  for (size_t i = 0; i < points.size(); ++i) outline.push_back({points[i], points[(i + 1) % points.size()]});
  return outline;
}

bool Inside(const std::vector<Segment2>& outline, Vec2d p) {
  bool inside = false;
  for (const auto& [a, b] : outline)
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y)) inside = !inside;
  return inside;
}

TEST(ChartFootprint, CoversEveryTexelThatASampleHits) {
  const auto outline = Outline({{0.2, 0.3}, {20.4, 3.1}, {17.7, 19.2}, {9.3, 8.8}, {4.1, 21.6}});
  const Bitmap cover = RasterizeCover(outline);
  const int samples = 16;
  for (int y = 0; y < cover.height() * samples; ++y)
    for (int x = 0; x < cover.width() * samples; ++x) {
      const Vec2d p{(x + 0.5) / samples, (y + 0.5) / samples};
      EXPECT_TRUE(!Inside(outline, p) || cover.Get(x / samples, y / samples)) << p.x << " " << p.y;
    }
}

TEST(ChartFootprint, RectangleOnTheGridTouchesNoNeighbour) {
  const Bitmap cover = RasterizeCover(Outline({{0, 0}, {7, 0}, {7, 3}, {0, 3}}));
  EXPECT_EQ(cover.width(), 7);
  EXPECT_EQ(cover.height(), 3);
  EXPECT_EQ(cover.Count(), 21);
}

TEST(ChartFootprint, FourQuarterTurnsAreNone) {
  const Bitmap cover = RasterizeCover(Outline({{0, 0}, {70.5, 3}, {12, 9.5}}));
  Bitmap turned = cover;
  for (int i = 0; i < 4; ++i) turned = TurnQuarter(turned);
  for (int y = 0; y < cover.height(); ++y)
    for (int x = 0; x < cover.width(); ++x) EXPECT_EQ(cover.Get(x, y), turned.Get(x, y));
}

TEST(ChartFootprint, DilationReachesExactlyItsRadius) {
  Bitmap dot(1, 1);
  dot.Set(0, 0);
  EXPECT_EQ(Dilate(dot, 2).Count(), 25);
  EXPECT_EQ(ToBlocks(Dilate(dot, 2), 4, 0, 0).Count(), 4);
  EXPECT_EQ(ToBlocks(Dilate(dot, 1), 4, 1, 0).Count(), 1);
}

// The naive search: every spot, every cell.
std::optional<Spot> NaiveLowest(const Bitmap& page, const Bitmap& shape) {
  for (int y = 0; y + shape.height() <= page.height(); ++y)
    for (int x = 0; x + shape.width() <= page.width(); ++x) {
      bool free = true;
      for (int v = 0; v < shape.height() && free; ++v)
        for (int u = 0; u < shape.width() && free; ++u) free = !(shape.Get(u, v) && page.Get(x + u, y + v));
      if (free) return Spot{x, y};
    }
  return std::nullopt;
}

TEST(ChartPage, FindsTheSpotThatTheNaiveSearchFinds) {
  Page page(150, 90);
  Bitmap naive(150, 90);
  for (int i = 0; i < 60; ++i) {
    const double w = 5 + i * 7 % 23, h = 4 + i * 11 % 17;
    const Bitmap shape = RasterizeCover(Outline({{0, 0.2 * h}, {0.4 * w, 0}, {w, 0.7 * h}, {0.5 * w, h}}));
    const Shape runs = MakeShape(shape, shape, 0);
    const auto expected = NaiveLowest(naive, shape), found = page.FindLowest(runs, 0, 90);
    ASSERT_EQ(expected.has_value(), found.has_value()) << i;
    if (!found) continue;
    ASSERT_EQ(expected->x, found->x) << i;
    ASSERT_EQ(expected->y, found->y) << i;
    page.Place(runs, *found);
    shape.ForEachRun(
        [&](int y, int begin, int end) { naive.SetRange(found->y + y, found->x + begin, found->x + end); });
  }
}

TEST(ChartOrient, TurnedRectangleIsFoundUpright) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  std::vector<Vec2d> corners{{0, 0}, {5, 0}, {5, 2}, {0, 2}};
  for (Vec2d& p : corners) p = {c * p.x - s * p.y, s * p.x + c * p.y};
  const Vec2d axis = LeastRectangleAxis(Outline(corners));
  const Vec2d size = SizeAlong(Outline(corners), axis);
  EXPECT_NEAR(size.x * size.y, 10, 1e-9);  // doubles
}

}  // namespace
}  // namespace bakewell::chart
