#include <gtest/gtest.h>

#include <limits>

#include "server/chart/choose.h"
#include "server/chart/generate.h"
#include "server/chart/keep.h"
#include "server/chart/picture.h"
#include "tests/unit/chart/shapes.h"

namespace bakewell {
namespace {

Object ObjectOf(const chart::Soup& soup, const std::string& name) {
  Object object;
  object.name = name;
  object.position = soup.position;
  object.normal.resize(soup.position.size(), Vec3f{0, 1, 0});
  object.uv0.resize(soup.position.size());
  object.index = soup.index;
  return object;
}

// Two triangles of a square that share an edge, and one apart.
Object KeptObject() {
  Object object = ObjectOf(
      {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {6, 1, 0}}, {0, 1, 2, 0, 2, 3, 4, 5, 6}},
      "kept");
  object.uv1 = {{0, 0}, {0.25f, 0}, {0.25f, 0.25f}, {0, 0.25f}, {0.5f, 0.5f}, {0.75f, 0.5f}, {0.75f, 0.75f}};
  return object;
}

TEST(KeepCharts, UvConnectedTrianglesAreOneChart) {
  Scene scene;
  scene.objects = {KeptObject()};
  const auto layout = KeepCharts(scene, {64, 64});
  ASSERT_TRUE(layout.ok()) << layout.status();
  EXPECT_EQ(layout->charts.size(), 2u);
  EXPECT_EQ(layout->objects[0].chart_of_triangle, (std::vector<int32_t>{0, 0, 1}));
  EXPECT_EQ(layout->objects[0].uv[2], (TexelUv{16, 16}));
  EXPECT_FLOAT_EQ(layout->texels_per_metre, 16);
}

TEST(KeepCharts, MissingAndBadUvsNameTheObject) {
  Scene scene;
  scene.objects = {KeptObject()};
  scene.objects[0].uv1.clear();
  EXPECT_NE(KeepCharts(scene, {64, 64}).status().message().find("kept"), absl::string_view::npos);
  for (const float bad : {-0.1f, 1.1f, std::numeric_limits<float>::quiet_NaN()}) {
    scene.objects[0] = KeptObject();
    scene.objects[0].uv1[3].x = bad;
    EXPECT_EQ(KeepCharts(scene, {64, 64}).status().code(), absl::StatusCode::kInvalidArgument) << bad;
  }
}

// `bake --uv keep` of a level without TEXCOORD_1 and without a page size crashed: its density was measured first.
TEST(ChooseCharts, KeepingChartsThatAreNotThereIsRefused) {
  Scene scene;
  scene.objects = {ObjectOf({{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, {0, 1, 2}}, "bare")};
  BakeSettings settings;
  settings.uv = UvMode::kKeep;
  const auto layout = ChooseCharts(scene, settings);
  EXPECT_EQ(layout.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(KeepCharts, ObjectsThatOnlyBlockNeedNoUvs) {
  Scene scene;
  scene.objects = {KeptObject(), ObjectOf(chart::Box(), "blocker")};
  scene.objects[1].lightmapped = false;
  const auto layout = KeepCharts(scene, {64, 64});
  ASSERT_TRUE(layout.ok());
  EXPECT_TRUE(layout->objects[1].index.empty());
}

// Texel area / space area of an object's first triangle, square-rooted.
double DensityOf(const Scene& scene, const AtlasLayout& layout, size_t o) {
  const ObjectCharts& charts = layout.objects[o];
  const TexelUv a = charts.uv[charts.index[0]], b = charts.uv[charts.index[1]], c = charts.uv[charts.index[2]];
  const double texels = (double(b.x) - a.x) * (double(c.y) - a.y) - (double(b.y) - a.y) * (double(c.x) - a.x);
  const auto p = [&](int k) { return ToDouble(scene.objects[o].position[charts.xref[charts.index[k]]]); };
  return std::sqrt(texels / Length(Cross(p(1) - p(0), p(2) - p(0))));
}

TEST(GenerateCharts, DensityFactorsHoldAcrossObjects) {
  Scene scene;
  scene.objects = {ObjectOf(chart::Box(), "plain"), ObjectOf(chart::Box(), "wall"), ObjectOf(chart::Box(), "fine")};
  scene.objects[1].lightmapped = false;
  scene.objects[2].density = 2;
  const auto layout = GenerateCharts(scene, {.resolution = 256});
  ASSERT_TRUE(layout.ok()) << layout.status();
  EXPECT_TRUE(layout->objects[1].uv.empty());
  // Rectangles are snapped to whole texels, by half a percent at most.
  EXPECT_NEAR(DensityOf(scene, *layout, 2) / DensityOf(scene, *layout, 0), 2, 0.02);
  EXPECT_EQ(layout->pages, (std::vector<PageSize>{{256, 256}}));
  EXPECT_EQ(layout->charts.size(), 12u);
  EXPECT_EQ(layout->charts[6].object, 2);
}

TEST(GenerateCharts, TexelsPerMetreDecidesThePages) {
  Scene scene;
  for (int i = 0; i < 4; ++i) scene.objects.push_back(ObjectOf(chart::Box(), "box"));
  const auto layout = GenerateCharts(scene, {.texels_per_metre = 50, .max_resolution = 128});
  ASSERT_TRUE(layout.ok());
  EXPECT_GE(layout->pages.size(), 4u);  // 24 faces of 50 x 50 texels
  EXPECT_EQ(layout->texels_per_metre, 50);
}

int64_t TexelsOf(const AtlasLayout& layout) {
  int64_t texels = 0;
  for (const PageSize& page : layout.pages) texels += int64_t{page.width} * page.height;
  return texels;
}

// A small level got a page of 1024 x 1024, nearly empty.
TEST(GenerateCharts, ASmallLevelGetsASmallPage) {
  Scene scene;
  for (int i = 0; i < 4; ++i) scene.objects.push_back(ObjectOf(chart::Box(), "box"));
  const auto layout = GenerateCharts(scene, {.texels_per_metre = 50});
  ASSERT_TRUE(layout.ok());
  ASSERT_EQ(layout->pages.size(), 1u);
  EXPECT_EQ(layout->pages[0].width % 4, 0);
  EXPECT_EQ(layout->pages[0].height % 4, 0);
  // 24 faces of 50 x 50 texels take 13 x 13 blocks with their gutter.
  EXPECT_LE(TexelsOf(*layout), 24 * 52 * 52 * 5 / 4);
  const auto fixed = GenerateCharts(scene, {.resolution = 512, .texels_per_metre = 50});
  ASSERT_TRUE(fixed.ok());
  EXPECT_EQ(fixed->pages, (std::vector<PageSize>{{512, 512}}));
}

// Four and a bit pages' worth took five whole pages.
TEST(GenerateCharts, SeveralPagesAreNoLargerThanTheyNeed) {
  Scene scene;
  for (int i = 0; i < 11; ++i) scene.objects.push_back(ObjectOf(chart::Box(), "box"));
  const auto layout = GenerateCharts(scene, {.texels_per_metre = 20, .max_resolution = 128});
  ASSERT_TRUE(layout.ok());
  EXPECT_EQ(layout->pages.size(), 3u);  // 66 faces of 20 x 20 texels, 24 x 24 with their gutter: 25 a page
  EXPECT_EQ(layout->pages[0].width, 128);
  EXPECT_LE(layout->pages[0].height, 124);
  const auto more = GenerateCharts(scene, {.texels_per_metre = 28, .max_resolution = 128});
  ASSERT_TRUE(more.ok());
  EXPECT_EQ(more->pages.size(), 5u);  // 32 x 32: 16 a page, 66 / 5 = 13.2 need 4 rows
  EXPECT_EQ(more->pages[0].height, 128);
}

TEST(GenerateCharts, ChartDensitiesMoveTexelsWithinThePage) {
  Scene scene;
  scene.objects = {ObjectOf(chart::Box(), "box")};
  GenerateOptions options{.resolution = 256};
  options.chart_density = {2, 1, 1, 1, 1, 1};
  const auto layout = GenerateCharts(scene, options);
  ASSERT_TRUE(layout.ok());
  EXPECT_EQ(layout->pages, (std::vector<PageSize>{{256, 256}}));
  EXPECT_NEAR(DensityOf(scene, *layout, 0) / layout->texels_per_metre, 2, 0.02);  // as above
  options.chart_density.pop_back();
  EXPECT_EQ(GenerateCharts(scene, options).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(DrawCharts, ColoursWhatTrianglesCover) {
  Scene scene;
  scene.objects = {KeptObject()};
  const auto layout = KeepCharts(scene, {64, 64});
  ASSERT_TRUE(layout.ok());
  const std::vector<uint8_t> rgb = DrawCharts(*layout, 0);
  const auto lit = [&](int x, int y) { return rgb[3 * (64 * y + x)] + rgb[3 * (64 * y + x) + 1] > 0; };
  EXPECT_TRUE(lit(8, 8));
  EXPECT_FALSE(lit(20, 8));
}

}  // namespace
}  // namespace bakewell
