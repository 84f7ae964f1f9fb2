#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "server/chart/flatten/flatten.h"
#include "server/chart/flatten/overlap.h"
#include "server/chart/flatten/split.h"
#include "server/chart/flatten/stretch.h"
#include "tests/unit/chart/shapes.h"

namespace bakewell::chart {
namespace {

Surface SurfaceOf(const Soup& soup) { return BuildSurface(soup.position, soup.index); }

std::vector<uint32_t> AllFaces(const Surface& surface) {
  std::vector<uint32_t> faces(surface.FaceCount());
  std::iota(faces.begin(), faces.end(), 0u);
  return faces;
}

TEST(ChartFlatten, PlaneIsExact) {
  Soup soup;
  soup.position = {{0, 0, 0}, {3, 0, 4}, {3, 2, 4}, {0, 2, 0}};
  soup.index = {0, 1, 2, 0, 2, 3};
  const Surface surface = SurfaceOf(soup);
  const auto charts = Flatten(surface, AllFaces(surface), {});
  ASSERT_EQ(charts.size(), 1u);
  // Rounding of doubles only.
  EXPECT_NEAR(MeasureStretch(surface, charts[0]).l2, 1, 1e-12);
}

TEST(ChartFlatten, CylinderRollsOutInOneChart) {
  const Surface surface = SurfaceOf(CylinderWall(60, 5.5));
  const auto charts = Flatten(surface, AllFaces(surface), {});
  ASSERT_EQ(charts.size(), 1u);
  // A faceted cylinder is developable: what is left is where the iterations stop.
  EXPECT_NEAR(MeasureStretch(surface, charts[0]).l2, 1, 1e-4);
}

TEST(ChartFlatten, ClosedSphereIsCutUntilEveryPromiseHolds) {
  const Surface surface = SurfaceOf(Sphere(16, 1));
  const ChartOptions options{.maxStretch = 1.01f};
  size_t faces = 0;
  for (const FlatChart& chart : Flatten(surface, AllFaces(surface), options)) {
    faces += chart.face.size();
    EXPECT_TRUE(FindConflicts(surface, chart).None());
    EXPECT_LE(MeasureStretch(surface, chart).l2, options.maxStretch);
  }
  EXPECT_EQ(faces, surface.FaceCount());
}

TEST(ChartFlatten, AreaInThePlaneIsAreaInSpace) {
  const Surface surface = SurfaceOf(Sphere(12, 2));
  for (const FlatChart& chart : Flatten(surface, AllFaces(surface), {})) {
    double plane = 0, space = 0;
    for (size_t i = 0; i < chart.face.size(); ++i) {
      plane += SignedArea2(chart, i) / 2;
      space += surface.area[chart.face[i]];
    }
    EXPECT_NEAR(plane / space, 1, 1e-9);  // doubles
  }
}

// A flat ribbon of quads laid round a ring: with more than a full turn its ends lie on one another, and no face is
// turned over.
FlatChart Ribbon(const Surface& surface, double turn) {
  std::vector<uint32_t> faces(surface.FaceCount());
  std::iota(faces.begin(), faces.end(), 0u);
  FlatChart chart = LocalChart(surface, faces);
  double low = surface.position[0].x, high = low;
  for (const Vec3d& p : surface.position) low = std::min(low, p.x), high = std::max(high, p.x);
  for (size_t v = 0; v < chart.vertex.size(); ++v) {
    const Vec3d p = surface.position[chart.vertex[v]];
    const double angle = turn * (p.x - low) / (high - low), radius = 2 - p.y;
    chart.uv[v] = {radius * std::sin(angle), -radius * std::cos(angle)};
  }
  return chart;
}

TEST(ChartConflicts, RibbonThatReturnsOverItselfIsSeen) {
  Soup soup;
  for (int x = 0; x <= 40; ++x)
    for (int y = 0; y < 2; ++y) soup.position.push_back({float(x), float(y), 0});
  for (uint32_t x = 0; x < 40; ++x)
    soup.index.insert(soup.index.end(), {2 * x, 2 * x + 2, 2 * x + 3, 2 * x, 2 * x + 3, 2 * x + 1});
  const Surface surface = SurfaceOf(soup);
  EXPECT_TRUE(FindConflicts(surface, Ribbon(surface, 6.0)).None());
  const FlatChart overlapping = Ribbon(surface, 7.0);
  for (size_t i = 0; i < overlapping.face.size(); ++i) ASSERT_FALSE(IsFlipped(overlapping, i));
  EXPECT_FALSE(FindConflicts(surface, overlapping).None());
}

TEST(ChartConflicts, BowTieIsSeen) {
  Soup soup;
  soup.position = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}};
  soup.index = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
  const Surface surface = SurfaceOf(soup);
  FlatChart chart = LocalChart(surface, AllFaces(surface));
  for (size_t v = 0; v < chart.vertex.size(); ++v) {
    const Vec3d p = surface.position[chart.vertex[v]];
    chart.uv[v] = {p.x, p.y};
  }
  EXPECT_TRUE(FindConflicts(surface, chart).None());
  // One corner pulled over its neighbour turns a face over.
  chart.uv[chart.corner[1][2]] = {10, -10};
  EXPECT_FALSE(FindConflicts(surface, chart).None());
}

TEST(ChartSplit, PartsAreConnectedAndComplete) {
  const Surface surface = SurfaceOf(Sphere(10, 3));
  const auto parts = SplitInTwo(surface, AllFaces(surface));
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].size() + parts[1].size(), surface.FaceCount());
  for (const auto& part : parts) EXPECT_EQ(ConnectedParts(surface, part).size(), 1u);
}

}  // namespace
}  // namespace bakewell::chart
