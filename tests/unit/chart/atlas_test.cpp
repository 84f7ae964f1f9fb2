#include "server/chart/atlas.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>
#include <set>

#include "server/chart/flatten/stretch.h"
#include "server/chart/obj.h"
#include "tests/unit/chart/shapes.h"

namespace bakewell::chart {
namespace {

Atlas MustGenerate(const Soup& soup, const PackOptions& pack = {}, const ChartOptions& options = {}) {
  const MeshDecl decl = soup.Decl();
  auto atlas = Generate(std::span(&decl, 1), options, pack);
  EXPECT_TRUE(atlas.ok()) << atlas.status();
  return *std::move(atlas);
}

std::string Bytes(const Soup& soup, const Atlas& atlas) { return FormatObj({soup.position, soup.index}, atlas); }

TEST(ChartAtlas, SameBytesForAnyThreadCount) {
  const Soup soup = Sphere(30, 1.7);
  std::string first;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const std::string bytes = Bytes(soup, MustGenerate(soup, {.resolution = 256}));
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first) << threads;
  }
}

TEST(ChartAtlas, PowerOfTwoScaleGivesTheSameTexels) {
  const Soup soup = Sphere(20, 1.3);
  const Atlas one = MustGenerate(soup, {.resolution = 256});
  for (const float scale : {0x1p-10f, 0x1p10f}) {
    Soup scaled = soup;
    for (Vec3f& p : scaled.position) p = p * scale;
    const Atlas other = MustGenerate(scaled, {.resolution = 256});
    ASSERT_EQ(other.meshes[0].vertexArray.size(), one.meshes[0].vertexArray.size());
    for (size_t v = 0; v < one.meshes[0].vertexArray.size(); ++v)
      for (int c = 0; c < 2; ++c)
        ASSERT_EQ(other.meshes[0].vertexArray[v].uv[c], one.meshes[0].vertexArray[v].uv[c]) << v;
  }
}

// The faces of each chart.
std::vector<std::vector<uint32_t>> FacesOfCharts(const Soup& soup) {
  const MeshDecl decl = soup.Decl();
  const auto charts = ComputeCharts(std::span(&decl, 1), {});
  EXPECT_TRUE(charts.ok()) << charts.status();
  std::vector<std::vector<uint32_t>> faces;
  for (const FlatChart& chart : (*charts)[0].charts) faces.push_back(chart.face);
  return faces;
}

// Dense and regular meshes came out in other charts: their costs were equal but for the rounding of the input.
TEST(ChartAtlas, DecimalScaleGivesTheSameCharts) {
  for (const Soup& soup : {Sphere(20, 1.3), Sphere(70, 1), Sphere(71, 1.6)}) {
    const auto one = FacesOfCharts(soup);
    for (const float scale : {0.001f, 0.003f, 0.01f, 0.1f, 3.0f, 100.0f, 700.0f, 1000.0f}) {
      Soup scaled = soup;
      for (Vec3f& p : scaled.position) p = p * scale;
      EXPECT_EQ(FacesOfCharts(scaled), one) << "x" << scale << ", " << soup.position.size() << " vertices";
    }
  }
}

// Mostly flat meshes had their few curved charts at the bound: a large plate, far from a bowl.
TEST(ChartAtlas, NoChartStretchesManyTimesTheMeansOfItsMesh) {
  Soup soup = Sphere(24, 1);
  const uint32_t base = static_cast<uint32_t>(soup.position.size());
  soup.position.insert(soup.position.end(), {{9, 0, 0}, {19, 0, 0}, {19, 10, 0}, {9, 10, 0}});
  for (const uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) soup.index.push_back(base + i);
  const MeshDecl decl = soup.Decl();
  const auto charts = ComputeCharts(std::span(&decl, 1), {});
  ASSERT_TRUE(charts.ok());
  double sum = 0, area = 0, most = 0;
  const Surface& surface = (*charts)[0].surface;
  for (const FlatChart& chart : (*charts)[0].charts) {
    const double excess = MeasureStretch(surface, chart).l2 - 1;
    most = std::max(most, excess);
    for (const uint32_t f : chart.face) sum += surface.area[f] * excess, area += surface.area[f];
  }
  EXPECT_LT(5 * sum / area, 0.001);  // so that the free share of the bound, 0.004 / 4, is the limit
  EXPECT_LE(most, 0.001 + 1e-6);     // a float's rounding of the bound
}

TEST(ChartAtlas, BoxSidesAreRectanglesOnTheTexelGrid) {
  const Atlas atlas = MustGenerate(Box(), {.resolution = 256});
  EXPECT_EQ(atlas.chartCount, 6u);
  for (const Vertex& v : atlas.meshes[0].vertexArray)
    for (const float x : v.uv) EXPECT_EQ(x, std::round(x));
}

TEST(ChartAtlas, MirroredInstanceIsValid) {
  Soup soup = Sphere(12, 1);
  for (Vec3f& p : soup.position) p.x = -p.x;  // a mirrored transform that keeps the winding
  const Atlas atlas = MustGenerate(soup, {.resolution = 256});
  const Mesh& mesh = atlas.meshes[0];
  for (size_t t = 0; t < soup.index.size() / 3; ++t) {
    const float* a = mesh.vertexArray[mesh.indexArray[3 * t]].uv;
    const float* b = mesh.vertexArray[mesh.indexArray[3 * t + 1]].uv;
    const float* c = mesh.vertexArray[mesh.indexArray[3 * t + 2]].uv;
    EXPECT_GE((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0) << t;
  }
}

TEST(ChartAtlas, NoTwoChartsShareABlock) {
  Soup soup;
  for (int i = 0; i < 40; ++i) {  // separate triangles of many shapes
    const float x = static_cast<float>(i);
    const uint32_t base = static_cast<uint32_t>(soup.position.size());
    soup.position.insert(soup.position.end(), {{x, 0, 0}, {x + 0.3f + 0.01f * x, 0, 0}, {x, 0.2f + 0.02f * x, x}});
    soup.index.insert(soup.index.end(), {base, base + 1, base + 2});
  }
  const Atlas atlas = MustGenerate(soup, {.resolution = 256, .blockAlign = true});
  std::map<std::pair<int, int>, std::set<int>> charts_of_block;
  const Mesh& mesh = atlas.meshes[0];
  for (size_t t = 0; t < soup.index.size() / 3; ++t) {
    // Dense barycentric samples of the triangle.
    const Vertex &a = mesh.vertexArray[mesh.indexArray[3 * t]], &b = mesh.vertexArray[mesh.indexArray[3 * t + 1]],
                 &c = mesh.vertexArray[mesh.indexArray[3 * t + 2]];
    for (int i = 0; i <= 200; ++i)
      for (int j = 0; i + j <= 200; ++j) {
        const double u = i / 200.0, v = j / 200.0, w = 1 - u - v;
        const double x = w * a.uv[0] + u * b.uv[0] + v * c.uv[0], y = w * a.uv[1] + u * b.uv[1] + v * c.uv[1];
        charts_of_block[{static_cast<int>(x / 4), static_cast<int>(y / 4)}].insert(a.chartIndex);
      }
  }
  for (const auto& [block, charts] : charts_of_block)
    EXPECT_EQ(charts.size(), 1u) << block.first << "," << block.second;
}

TEST(ChartAtlas, FixedDensityMakesAsManyPagesAsItNeeds) {
  Soup soup;
  for (uint32_t i = 0; i < 9; ++i) {
    const float z = static_cast<float>(i);
    soup.position.insert(soup.position.end(), {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}});
    soup.index.insert(soup.index.end(), {4 * i, 4 * i + 1, 4 * i + 2, 4 * i, 4 * i + 2, 4 * i + 3});
  }
  const Atlas atlas = MustGenerate(soup, {.texelsPerUnit = 60, .resolution = 128});
  EXPECT_EQ(atlas.width, 128u);
  EXPECT_EQ(atlas.atlasCount, 3u);  // four squares of 60 and their gutter a page
  EXPECT_EQ(atlas.texelsPerUnit, 60);
}

TEST(ChartAtlas, InputChartsAreKeptOnRequest) {
  const Soup soup = CylinderWall(24, 3);
  std::vector<Vec2f> uv;
  for (int y = 0; y <= 4; ++y)
    for (int x = 0; x <= 24; ++x) uv.push_back({-static_cast<float>(x) / 24, static_cast<float>(y) / 4});  // mirrored
  MeshDecl decl = soup.Decl();
  decl.vertexUvData = uv;
  const auto atlas = Generate(std::span(&decl, 1), {.useInputMeshUvs = true}, {.resolution = 256});
  ASSERT_TRUE(atlas.ok());
  EXPECT_EQ(atlas->chartCount, 1u);
}

TEST(ChartAtlas, IndexOutOfRangeIsTheCallersFault) {
  Soup soup = Box();
  soup.index[4] = 1000;
  const MeshDecl decl = soup.Decl();
  const auto atlas = Generate(std::span(&decl, 1), {}, {});
  EXPECT_EQ(atlas.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(ChartAtlas, AbsurdDensityIsRefusedNotAllocated) {
  Soup soup;
  for (uint32_t i = 0; i < 300; ++i) {
    const float z = static_cast<float>(i);
    soup.position.insert(soup.position.end(), {{0, 0, z}, {1, 0, z}, {1, 1, z}});
    soup.index.insert(soup.index.end(), {3 * i, 3 * i + 1, 3 * i + 2});
  }
  const MeshDecl decl = soup.Decl();
  const auto atlas = Generate(std::span(&decl, 1), {}, {.texelsPerUnit = 1e9f, .resolution = 64});
  EXPECT_EQ(atlas.status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(ChartAtlas, NothingToChartIsAnEmptyAtlas) {
  const MeshDecl decl;
  const auto atlas = Generate(std::span(&decl, 1), {}, {});
  ASSERT_TRUE(atlas.ok());
  EXPECT_EQ(atlas->chartCount, 0u);
  EXPECT_EQ(atlas->meshes.size(), 1u);
}

}  // namespace
}  // namespace bakewell::chart
