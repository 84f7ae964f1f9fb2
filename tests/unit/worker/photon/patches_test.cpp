#include "worker/photon/patches.h"

#include <gtest/gtest.h>

#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

std::vector<std::vector<uint32_t>> Patches(const Scene& scene) {
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  const auto patches = GrowPatches(*world);
  std::vector<int> uses(world->triangles().size(), 0);
  for (const auto& patch : patches) {
    for (const uint32_t k : patch) {
      ++uses[k];
      EXPECT_GT(Dot(world->triangles()[k].normal, world->triangles()[patch[0]].normal), 0.819f);  // 35 degrees
    }
  }
  for (const int n : uses) EXPECT_EQ(n, 1) << "every triangle is in one patch";
  return patches;
}

TEST(GrowPatches, BoxHasSixOfTwoTriangles) {
  SceneBuilder builder;
  builder.AddBox({0, 0, 0}, {1, 1, 1}, {.lightmapped = false});
  const auto patches = Patches(builder.Build());
  ASSERT_EQ(patches.size(), 6u);
  for (const auto& patch : patches) EXPECT_EQ(patch.size(), 2u);
}

TEST(GrowPatches, SphereIsCutWhereItTurns) {
  SceneBuilder builder;
  builder.AddSphere({0, 0, 0}, 1, 24, {.lightmapped = false});
  const auto patches = Patches(builder.Build());
  EXPECT_GT(patches.size(), 8u);  // a cap of 35 degrees is a twelfth of the sphere
  EXPECT_LT(patches.size(), 200u);
}

TEST(GrowPatches, EdgesOfThreeTrianglesAndOppositeWindingsSeparate) {
  // Two coplanar triangles and a fin on their common edge.
  SceneBuilder fin;
  fin.AddTriangle({0, 0, 0}, {1, 0, 0}, {0.5, 0, 1}, {.lightmapped = false});
  fin.AddTriangle({1, 0, 0}, {0, 0, 0}, {0.5, 0, -1}, {.lightmapped = false});
  EXPECT_EQ(Patches(fin.Build()).size(), 1u);
  fin.AddTriangle({0, 0, 0}, {1, 0, 0}, {0.5, 0.1, 1}, {.lightmapped = false});
  EXPECT_EQ(Patches(fin.Build()).size(), 3u);
  SceneBuilder flipped;
  flipped.AddTriangle({0, 0, 0}, {1, 0, 0}, {0.5, 0, 1}, {.lightmapped = false});
  flipped.AddTriangle({0, 0, 0}, {1, 0, 0}, {0.5, 0, -1}, {.lightmapped = false});
  EXPECT_EQ(Patches(flipped.Build()).size(), 2u);
}

}  // namespace
}  // namespace bakewell
