#include "worker/texel/validity.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/skip_levels.h"
#include "worker/filter/connect.h"

namespace bakewell {
namespace {

// A floor of 8 x 8 m and as many texels: page (x, y) is world (x, 0, -y). A box without a lightmap stands in it.
Scene FloorWithBox(double x0, double x1, double z0, double z1) {
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
  builder.AddBox({x0, -0.5, -z1}, {x1, 2, -z0}, {.lightmapped = false});
  return builder.Build();
}

struct Probed {
  TexelValidity validity;
  uint16_t mask;
};

Probed Probe(const Scene& scene, int x, int y, BackfaceMode mode = BackfaceMode::kReflect) {
  BakeSettings settings;
  settings.footprint = 1;
  settings.backfaces = mode;
  const PreparedLevel prepared = PrepareInMemory(scene, settings);
  const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * y + x)]];
  TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  const TexelValidity validity = ProbeValidity(*prepared.world, texel, std::nullopt, PartSearch::kAll, {}, sampler);
  return {validity, sampler.valid_mask()};
}

// Texels are 1 m wide: two radii are 1.41 m. The box's nearest side is at x = 5.
TEST(LookAround, CrowdedWhereSomethingElseRisesWithinTwoRadii) {
  const Scene scene = FloorWithBox(5, 6, 0, 8);
  const PreparedLevel prepared = PrepareInMemory(scene, {});
  for (int x = 0; x < 8; ++x) {
    const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * 3 + x)]];
    const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
    EXPECT_EQ(LookAround(*prepared.world, prepared.layout, texel, sampler, 1).crowded, x >= 4 && x <= 6) << x;
  }
}

// Rays between neighbours find nothing that it did not say.
TEST(LookAround, TexelsThatAreNotCrowdedHaveTheConnectionsThatRaysFind) {
  for (const Scene& scene : {FloorWithBox(5, 6, 0, 8), FloorWithBox(2.3, 4.1, 3.2, 3.3), RoomsLevel(64, 1)}) {
    const PreparedLevel prepared = PrepareInMemory(scene, {});
    const TexelMap& map = prepared.texels;
    int64_t asked = 0, all = 0;
    for (uint32_t i = 0; i < map.texels.size(); ++i) {
      const TexelSampler sampler(*prepared.world, prepared.layout, map, map.texels[i]);
      const bool crowded = LookAround(*prepared.world, prepared.layout, map.texels[i], sampler, 1).crowded;
      EXPECT_EQ(ConnectTexel(*prepared.world, map, i, crowded, asked), ConnectTexel(*prepared.world, map, i, true, all))
          << i;
    }
    EXPECT_LT(asked, all);
  }
}

TEST(ProbeValidity, TexelDeepUnderABoxIsInvalid) {
  // The box's sides are 2.5 m from the texel's centre, its diagonal is 1.4 m.
  const Probed probed = Probe(FloorWithBox(1, 6, 1, 6), 3, 3);
  EXPECT_FALSE(probed.validity.valid);
  EXPECT_FALSE(probed.validity.pushed_out);
  EXPECT_EQ(probed.validity.backface_share, 1);
}

TEST(ProbeValidity, TexelJustInsideABoxIsPushedOut) {
  const Probed probed = Probe(FloorWithBox(1, 6, 1, 6), 1, 3);
  EXPECT_TRUE(probed.validity.valid);
  EXPECT_TRUE(probed.validity.pushed_out);
  EXPECT_EQ(probed.validity.backface_share, 1);
}

TEST(ProbeValidity, TexelBesideABoxIsValid) {
  for (const int x : {0, 6, 7}) {
    const Probed probed = Probe(FloorWithBox(1, 6, 1, 6), x, 3);
    EXPECT_TRUE(probed.validity.valid) << x;
    EXPECT_FALSE(probed.validity.pushed_out) << x;
    EXPECT_EQ(probed.validity.backface_share, 0) << x;
    EXPECT_EQ(probed.mask, 0xffff) << x;
  }
}

TEST(ProbeValidity, HalfCoveredTexelIsMasked) {
  // The box begins in the middle of the texel: columns 2 and 3 of its sixteenths are inside.
  const Probed probed = Probe(FloorWithBox(1.5, 6, 1, 6), 1, 3);
  EXPECT_TRUE(probed.validity.valid);
  EXPECT_FALSE(probed.validity.pushed_out);
  EXPECT_EQ(probed.mask, 0x3333);
  EXPECT_NEAR(probed.validity.backface_share, 0.5, 1e-6);
}

TEST(ProbeValidity, NearSearchFindsTheSameWithFewerRays) {
  BakeSettings settings;
  settings.footprint = 1;
  for (const auto& [x0, x, share] : {std::tuple(1.0, 3, 1.0f), {1.0, 1, 1.0f}, {1.0, 0, 0.0f}, {1.5, 1, 0.5f}}) {
    const PreparedLevel prepared = PrepareInMemory(FloorWithBox(x0, 6, 1, 6), settings);
    const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(24 + x)]];
    TexelSampler all(*prepared.world, prepared.layout, prepared.texels, texel), near = all;
    const BacksSeen seen{share, 0.5f};
    const Surroundings around = LookAround(*prepared.world, prepared.layout, texel, all, 1);
    EXPECT_EQ(around.divided, x == 1) << x;
    const TexelValidity a = ProbeValidity(*prepared.world, texel, seen, PartSearch::kAll, around, all);
    const TexelValidity b = ProbeValidity(*prepared.world, texel, seen, PartSearch::kNear, around, near);
    EXPECT_EQ(a.valid, b.valid) << x;
    EXPECT_EQ(a.pushed_out, b.pushed_out) << x;
    EXPECT_EQ(all.valid_mask(), near.valid_mask()) << x;
    EXPECT_EQ(b.rays_saved > 0, b.rays < a.rays) << x;
  }
}

TEST(ProbeValidity, BackFacesInTheDistanceDivideNoTexel) {
  // A wall half a room away turns its back to the floor: a fifth of each texel's rays meet it, and none is inside.
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
  builder.AddQuad({8, 0, 0}, {0, 0, -8}, {0, 5, 0}, {.lightmapped = false});
  const Scene scene = builder.Build();
  const PreparedLevel prepared = PrepareInMemory(scene, {});
  const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * 4 + 4)]];
  TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  const TexelValidity validity =
      ProbeValidity(*prepared.world, texel, BacksSeen{0.2f, 4}, PartSearch::kNear, {true, false}, sampler);
  EXPECT_TRUE(validity.valid);
  EXPECT_EQ(sampler.valid_mask(), 0xffff);
  EXPECT_EQ(validity.rays, 8);
}

// Symptom: rays along the ceiling missed a lamp's plate 1 cm below it, and all of the texel was taken to be as its
// covered centre was.
TEST(ProbeValidity, APlateThatHangsOverPartOfATexelDividesIt) {
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
  builder.AddQuad({1.4, 0.01, -3}, {3, 0, 0}, {0, 0, -3}, {.lightmapped = false});  // turns its back to the floor
  const Scene scene = builder.Build();
  BakeSettings settings;
  settings.footprint = 1;
  const PreparedLevel prepared = PrepareInMemory(scene, settings);
  const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * 4 + 1)]];
  for (const float share : {0.2f, 0.6f, 0.85f}) {
    TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
    const TexelValidity validity =
        ProbeValidity(*prepared.world, texel, BacksSeen{share, 0.02f}, PartSearch::kNear, {true, false}, sampler);
    EXPECT_TRUE(validity.valid) << share;
    EXPECT_EQ(sampler.valid_mask(), 0x3333) << share;
  }
}

// Symptom: the eight first rays of a texel missed the box that a sixteenth of it lies in, all of it was taken to be in
// the open, and what its samples found in there (a lamp from inside, at a hundred times the mean) was its light.
TEST(ProbeValidity, ADividedTexelIsSearchedWhateverItsFirstRaysMet) {
  BakeSettings settings;
  settings.footprint = 1;
  const PreparedLevel prepared = PrepareInMemory(FloorWithBox(1.7, 6, 3.7, 6), settings);  // a corner in texel (1, 3)
  const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * 3 + 1)]];
  TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  const Surroundings around = LookAround(*prepared.world, prepared.layout, texel, sampler, 1);
  EXPECT_TRUE(around.divided);
  const TexelValidity validity =
      ProbeValidity(*prepared.world, texel, BacksSeen{0, 0}, PartSearch::kNear, around, sampler);
  EXPECT_TRUE(validity.valid);
  EXPECT_EQ(sampler.valid_mask(), 0x7fff);
}

// What stands beside a texel, below it, far above it or has no back divides none.
TEST(LookAround, DividedWhereSomethingWithABackStandsOnTheTexel) {
  BakeSettings settings;
  settings.footprint = 1;
  const auto divided = [&](const Scene& scene, int x, int y) {
    const PreparedLevel prepared = PrepareInMemory(scene, settings);
    const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * y + x)]];
    const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
    return LookAround(*prepared.world, prepared.layout, texel, sampler, 1).divided;
  };
  const auto floor = [](double height, bool double_sided) {
    SceneBuilder builder({8, 8});
    builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
    Material material;
    material.double_sided = double_sided;
    builder.AddQuad({3.5, height, 0}, {0, 1, 0}, {0, 0, -8},
                    {.material = builder.AddMaterial(material), .lightmapped = false});
    return builder.Build();
  };
  EXPECT_TRUE(divided(floor(0, false), 3, 3));
  EXPECT_TRUE(divided(floor(-0.5, false), 3, 3));
  EXPECT_TRUE(divided(floor(0.5, false), 3, 3));
  EXPECT_FALSE(divided(floor(0.8, false), 3, 3));  // a radius is 0.71 m
  EXPECT_FALSE(divided(floor(-1.1, false), 3, 3));
  EXPECT_FALSE(divided(floor(0, false), 1, 3));
  EXPECT_FALSE(divided(floor(0, true), 3, 3));
  EXPECT_FALSE(divided(FloorWithBox(4, 6, 0, 8), 3, 3));         // its side stands on the texel's border
  EXPECT_TRUE(divided(FloorWithBox(3.6, 3.7, 4.6, 4.7), 3, 4));  // all of it within the texel
}

// Symptom: every texel of a mesh finer than the lightmap was searched, with twice the rays of all the rest.
TEST(LookAround, ManyTrianglesAloneDivideNothing) {
  SceneBuilder builder({8, 8});
  builder.AddQuad({0, 0, 0}, {8, 0, 0}, {0, 0, -8}, {.page = {0, 0, 8, 8}});
  for (int i = 0; i < 100; ++i) {
    builder.AddQuad({3 + 0.1 * (i % 10), -0.1, -4 - 0.1 * (i / 10)}, {0.1, 0, 0}, {0, 0, -0.1}, {.lightmapped = false});
  }
  const Scene scene = builder.Build();
  const PreparedLevel prepared = PrepareInMemory(scene, {});
  const Texel& texel = prepared.texels.texels[prepared.texels.texel_at[0][static_cast<size_t>(8 * 3 + 3)]];
  const TexelSampler sampler(*prepared.world, prepared.layout, prepared.texels, texel);
  const Surroundings around = LookAround(*prepared.world, prepared.layout, texel, sampler, 1);
  EXPECT_TRUE(around.crowded);
  EXPECT_FALSE(around.divided);
}

TEST(ProbeValidity, NothingHasABackWhereBackfacesPass) {
  const Probed probed = Probe(FloorWithBox(1, 6, 1, 6), 3, 3, BackfaceMode::kPass);
  EXPECT_TRUE(probed.validity.valid);
  EXPECT_EQ(probed.validity.rays, 0);
}

}  // namespace
}  // namespace bakewell
