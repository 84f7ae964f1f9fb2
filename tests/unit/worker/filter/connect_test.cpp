#include "worker/filter/connect.h"

#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "worker/filter/connections.h"

namespace bakewell {
namespace {

// A floor of 8 x 8 m and as many texels; a slab lies `height` above those from x = 4 on.
Scene FloorUnderASlab(double height) {
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
  builder.AddBox({4, height, -9}, {9, height + 0.5, 1}, {.lightmapped = false});
  return builder.Build();
}

// Whether the texels of columns x and x + 1 are connected in the middle row.
bool Connected(const Scene& scene, int x) {
  const PreparedLevel prepared = PrepareInMemory(scene, {});
  const TexelMap& map = prepared.texels;
  const auto texel_at = [&](int column) { return map.texel_at[0][static_cast<size_t>(8 * 4 + column)]; };
  int64_t rays = 0;
  for (const auto& [from, to] : {std::pair(x, x + 1), {x + 1, x}}) {
    const uint8_t open = ConnectTexel(*prepared.world, map, static_cast<uint32_t>(texel_at(from)), true, rays);
    for (size_t k = 0; k < 4; ++k) {
      if (kNeighbours[k][0] == to - from && kNeighbours[k][1] == 0) return (open >> k & 1) != 0;
    }
  }
  ADD_FAILURE() << "neither is among the other's first four neighbours";
  return false;
}

// Symptom: the dark between books on a shelf took the light of what lies outside of it, at twice to three times its
// own: a ray along the surface finds nothing that divides the two.
TEST(ConnectTexel, TheInsideOfAGapIsNotConnectedToItsOutside) {
  const Scene scene = FloorUnderASlab(0.2);
  EXPECT_FALSE(Connected(scene, 3));
  EXPECT_TRUE(Connected(scene, 1));
  EXPECT_TRUE(Connected(scene, 5));
}

TEST(ConnectTexel, WhatIsAsHighAsTexelsAreWideIsNoGap) { EXPECT_TRUE(Connected(FloorUnderASlab(2.1), 3)); }

}  // namespace
}  // namespace bakewell
