#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cstdlib>

#include "server/chart/atlas.h"
#include "tests/property/chart/judge.h"
#include "tests/property/chart/random_mesh.h"

namespace bakewell::chart {
namespace {

// How many random meshes; BAKEWELL_CHART_MESHES=10000 is the whole property, its first part runs by default.
uint64_t MeshCount() {
  const char* text = std::getenv("BAKEWELL_CHART_MESHES");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 1000;
}

PackOptions OptionsFor(uint64_t key) {
  PackOptions options;
  options.resolution = key % 5 == 0 ? 64 : 192;
  options.blockAlign = key % 3 == 0;
  options.rotateCharts = key % 7 != 0;
  options.padding = static_cast<uint32_t>(key % 4);
  options.bilinear = key % 2 == 0;
  return options;
}

TEST(ChartProperty, AnyMeshGivesAValidAtlasWithinItsTime) {
  tbb::parallel_for(uint64_t{0}, MeshCount(), [](uint64_t key) {
    const RandomMesh mesh = MakeRandomMesh(key);
    const MeshDecl decl{.vertexPositionData = mesh.position, .vertexUvData = {}, .indexData = mesh.index};
    const PackOptions options = OptionsFor(key);
    const auto begin = std::chrono::steady_clock::now();
    const auto atlas = Generate(std::span(&decl, 1), {}, options);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    ASSERT_TRUE(atlas.ok()) << key << ": " << atlas.status();
    EXPECT_EQ(FindFault(decl, *atlas, options.padding), "") << "mesh " << key;
    EXPECT_LE(atlas->width, options.resolution) << key;
    // A few hundred triangles: seconds, on a loaded machine and under a sanitizer.
    EXPECT_LT(seconds.count(), 20) << key;
  });
}

// Triangles thinner than a float lightmap resolves came out turned over.
TEST(ChartProperty, SliversThatOnceFlippedByRoundingDoNot) {
  for (const uint64_t key : {3252, 7111}) {
    const RandomMesh mesh = MakeRandomMesh(key);
    const MeshDecl decl{.vertexPositionData = mesh.position, .vertexUvData = {}, .indexData = mesh.index};
    const auto atlas = Generate(std::span(&decl, 1), {}, OptionsFor(key));
    ASSERT_TRUE(atlas.ok());
    EXPECT_EQ(FindFault(decl, *atlas, OptionsFor(key).padding), "") << key;
  }
}

// The judge itself: what it must see.
TEST(ChartJudge, SeesMovedFlippedAndDoublyMappedTriangles) {
  const std::vector<Vec3f> position{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}};
  const std::vector<uint32_t> index{0, 1, 2, 0, 2, 3, 4, 5, 6};
  const MeshDecl decl{.vertexPositionData = position, .vertexUvData = {}, .indexData = index};
  const auto atlas = Generate(std::span(&decl, 1), {}, {.resolution = 64});
  ASSERT_TRUE(atlas.ok());
  ASSERT_EQ(FindFault(decl, *atlas, 2), "");
  Atlas mapped_twice = *atlas;
  mapped_twice.meshes[0].chartArray[0].faceArray.push_back(2);
  EXPECT_NE(FindFault(decl, mapped_twice, 2), "");
  Atlas outside = *atlas;
  outside.meshes[0].vertexArray[0].uv[0] = 65;
  EXPECT_NE(FindFault(decl, outside, 2), "");
  Atlas flipped = *atlas;
  std::swap(flipped.meshes[0].vertexArray[0].uv[0], flipped.meshes[0].vertexArray[0].uv[1]);
  for (Vertex& v : flipped.meshes[0].vertexArray) v.uv[0] = 64 - v.uv[0];
  EXPECT_NE(FindFault(decl, flipped, 2), "");
  Atlas moved = *atlas;
  const Mesh& mesh = moved.meshes[0];
  for (int k = 0; k < 3; ++k)
    std::copy_n(mesh.vertexArray[mesh.indexArray[k]].uv, 2, moved.meshes[0].vertexArray[mesh.indexArray[6 + k]].uv);
  EXPECT_NE(FindFault(decl, moved, 2), "");
}

}  // namespace
}  // namespace bakewell::chart
