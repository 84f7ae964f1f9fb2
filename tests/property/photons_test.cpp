#include "worker/level/photons.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/skip_levels.h"
#include "worker/gather/outlook.h"
#include "worker/level/codec.h"

namespace bakewell {
namespace {

constexpr uint32_t kSeed = 5;

// A level with everything that photons need, for as long as it lives.
struct Prepared {
  PreparedLevel level;
  explicit Prepared(const Scene& scene) : level(PrepareInMemory(scene, {})) {}

  template <typename Use>
  auto With(Use use) const {
    const auto starts = [&](int walks) {
      return EmissionGuide::StartsIn(*level.world, level.layout, level.texels, walks, kSeed);
    };
    return use(PhotonScene{*level.world, *level.lights, std::ssize(level.texels.texels), starts});
  }
  int64_t Needed(BakeSettings settings) const {
    settings.seed = kSeed;
    const SilentProgress progress;
    return With([&](const PhotonScene& scene) { return PhotonsFor(scene, settings, progress).photons; });
  }
  GatherOutlook LookAheadWith(int64_t photons, uint32_t seed) const {
    return With([&](const PhotonScene& scene) {
      const auto stage = BuildPhotonStage(scene, photons, seed);
      PhotonMap map;
      map.flux.resize(2 * stage->cells.cells().size());
      SilentProgress progress;
      EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, 0, stage->plan.photons, progress,
                  map);
      const RadianceCache cache = EstimateDensity(scene.world, stage->cells, map, stage->plan, {}, progress);
      const LightTree tree(scene.lights);
      return LookAhead({scene.world, scene.lights, tree, stage->cells, cache}, scene.starts(512), 0.25f, seed);
    });
  }
};

// A room that gets its light through a slit of the sun, which few photons pass.
Scene RoomBehindASlit() { return SlitLevel(160, 0.2); }

TEST(PhotonsFor, APlainUnderTheSkyNeedsTheLeastAndARoomBehindASlitMore) {
  const Prepared plain(PlaneLevel(160)), room(RoomBehindASlit());
  const int64_t for_plain = plain.Needed({}), for_room = room.Needed({});
  EXPECT_LE(for_plain, 40000);
  EXPECT_GE(for_room, 2 * for_plain);
}

// What such a pilot leaves is what photons and density, done as tasks of their own, would come to.
TEST(PhotonsFor, APilotOfAsManyAsAreNeededIsTheBakes) {
  BakeSettings settings;
  settings.seed = kSeed;
  settings.quality = Quality::kPreview;
  SilentProgress progress;
  const auto choose = [&](const PhotonScene& scene) { return PhotonsFor(scene, settings, progress); };
  const Prepared plain(PlaneLevel(160)), room(RoomBehindASlit());
  EXPECT_FALSE(room.With(choose).flown.has_value());
  const PhotonChoice choice = plain.With(choose);
  ASSERT_TRUE(choice.flown.has_value());
  plain.With([&](const PhotonScene& scene) {
    const auto stage = BuildPhotonStage(scene, choice.photons, kSeed);
    PhotonMap map;
    map.flux.resize(2 * stage->cells.cells().size());
    EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, 0, stage->plan.photons, progress,
                map);
    const RadianceCache cache =
        EstimateDensity(scene.world, stage->cells, map, stage->plan, DensityOf(settings), progress);
    EXPECT_EQ(SerializeCache(choice.flown->cache), SerializeCache(cache));
    EXPECT_EQ(choice.flown->rays, map.totals.rays);
    EXPECT_EQ(choice.flown->cache.rays, cache.rays);
    return 0;
  });
}

TEST(PhotonsFor, ASmallerErrorNeedsMoreAndANumberOfOnesOwnIsKept) {
  const Prepared room(RoomBehindASlit());
  BakeSettings settings;
  settings.target_error = 0.1f;
  const int64_t coarse = room.Needed(settings);
  settings.target_error = 0.02f;
  EXPECT_GE(room.Needed(settings), 2 * coarse);
  settings.photons = 4711;
  EXPECT_EQ(room.Needed(settings), 4711);
}

// Texels are few, so that bounces cost little; the same pilot serves both.
TEST(PhotonsFor, HalfTheErrorNeedsFourTimesThePhotonsWhereTheirNoiseDecides) {
  const Prepared room(SlitLevel(24, 0.02));
  BakeSettings settings;
  settings.target_error = 0.014f;
  const auto coarse = static_cast<double>(room.Needed(settings));
  settings.target_error = 0.007f;
  EXPECT_NEAR(static_cast<double>(room.Needed(settings)) / coarse, 4, 0.01);
}

// A pilot that wants far more photons than there may be has said all: the number is the most, and time is not lost on a
// larger one.
TEST(PhotonsFor, NoLargerPilotFliesWhereTheFirstAsksForFarMoreThanThereAre) {
  const Prepared room(SlitLevel(24, 0.02));
  const auto pilots = [&](float target_error) {
    BakeSettings settings;
    settings.seed = kSeed;
    settings.target_error = target_error;
    return room.With([&](const PhotonScene& scene) {
      int flown = 0;
      const auto counted = [&](int walks) {
        ++flown;
        return scene.starts(walks);
      };
      constexpr int64_t kTexels = 4000;
      PhotonsFor({scene.world, scene.lights, kTexels, counted}, settings, SilentProgress());
      return flown;
    });
  };
  EXPECT_EQ(pilots(0.05f), 1);   // enough for what it asks
  EXPECT_EQ(pilots(0.003f), 2);  // more than a pilot of its size can tell
  EXPECT_EQ(pilots(0.0005f), 1);
}

TEST(PhotonsFor, IsTheSameForAnyNumberOfThreads) {
  const Prepared room(RoomBehindASlit());
  std::vector<int64_t> needed;
  for (const size_t threads : {size_t{1}, size_t{2}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    needed.push_back(room.Needed({}));
  }
  EXPECT_EQ(needed[0], needed[1]);
}

// By less than one over their number at first: where cells are large, hits are near and their light is not the
// photons'.
TEST(LookAhead, NoiseOfPhotonsFallsWithTheirNumber) {
  const Prepared room(RoomsLevel(96, 10));
  double few = 0, many = 0;
  for (uint32_t seed = 0; seed < 8; ++seed) {
    few += room.LookAheadWith(8000, seed).photon_variance;
    many += room.LookAheadWith(128000, seed).photon_variance;
  }
  EXPECT_GT(few, 0);
  EXPECT_GT(few / many, 2);
  EXPECT_LT(few / many, 16);
}

TEST(LookAhead, NothingIsNoiseWhereThereIsNoLight) {
  const Prepared dark(RoomsLevel(64, 0));
  const GatherOutlook outlook = dark.LookAheadWith(1000, 0);
  EXPECT_EQ(outlook.photon_variance, 0);
  EXPECT_EQ(outlook.ray_variance, 0);
}

// Symptom: photons that left a facade evenly were 8,192 times what they should be, or none, where one texel is lit.
TEST(EmitPhotons, OneLitTexelSendsItsFlux) {
  constexpr int kTexels = 64, kPhotons = 20000;
  Texture texture{.width = kTexels, .height = kTexels, .nearest = true, .rgba = std::vector<uint8_t>(4 * 64 * 64, 0)};
  std::fill_n(texture.rgba.begin() + 4 * (kTexels * 21 + 13), 3, uint8_t{255});
  SceneBuilder builder;
  Material material;
  material.emission = {100, 100, 100};
  material.emission_texture.texture = builder.AddTexture(texture);
  builder.AddQuad({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {.material = builder.AddMaterial(material), .page = {0, 0, 16, 16}});
  const Prepared level(builder.Build());
  level.With([&](const PhotonScene& scene) {
    const auto stage = BuildPhotonStage(scene, kPhotons, kSeed);
    PhotonMap map;
    map.flux.resize(2 * stage->cells.cells().size());
    const SilentProgress progress;
    EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, 0, stage->plan.photons, progress,
                map);
    const double flux = static_cast<double>(map.totals.emitted[1]) / stage->plan.fixed_point_scale;
    // A photon's flux has a variance of about 1.1 squares of the mean; Sobol points do better.
    EXPECT_NEAR(flux / (kPi * 100 * std::pow(2.0 / kTexels, 2)), 1, 0.02);
    EXPECT_LT(stage->plan.sources[0].max_weight, 100 * flux / kPhotons);
    return 0;
  });
}

// A room of 6 x 3 x 6 m in a field of 60 x 60 m under a sky; a window of 1 x 1 m in the wall at +X. Texels on its
// floor.
Scene RoomWithAWindow() {
  SceneBuilder builder({48, 48});
  builder.AddQuad({-30, -0.01, 30}, {60, 0, 0}, {0, 0, -60}, {.lightmapped = false});
  builder.AddQuad({0, 0, 6}, {6, 0, 0}, {0, 0, -6}, {.page = {0, 0, 48, 48}});
  builder.AddQuad({0, 3, 0}, {6, 0, 0}, {0, 0, 6}, {.lightmapped = false});
  builder.AddQuad({0, 0, 0}, {6, 0, 0}, {0, 3, 0}, {.lightmapped = false});
  builder.AddQuad({6, 0, 6}, {-6, 0, 0}, {0, 3, 0}, {.lightmapped = false});
  builder.AddQuad({0, 0, 6}, {0, 0, -6}, {0, 3, 0}, {.lightmapped = false});
  const auto pane = [&](double z, double y, double width, double height) {
    builder.AddQuad({6, y, z}, {0, 0, width}, {0, height, 0}, {.lightmapped = false});
  };
  pane(0, 0, 6, 1);
  pane(0, 2, 6, 1);
  pane(0, 1, 2.5, 1);
  pane(3.5, 1, 2.5, 1);
  builder.SetConstantSky({1, 1, 1});
  return builder.Build();
}

// Symptom: sparks. Where no mark of the guide's few told of a part of the sky, a photon from there was hundreds of
// times what others are, and so was the cell that it fell on. (0.66 with a walk for sixteen photons and no blocks of
// marks.)
TEST(EmitPhotons, WhatComesThroughAWindowIsSeldomHeavy) {
  const Prepared level(RoomWithAWindow());
  constexpr uint32_t kSeeds = 32, kFloor = 2;  // a triangle of it
  double sum = 0, squares = 0;
  for (uint32_t seed = 0; seed < kSeeds; ++seed) {
    const double flux = level.With([&](const PhotonScene& scene) {
      const auto stage = BuildPhotonStage(scene, 100000, seed);
      PhotonMap map;
      map.flux.resize(2 * stage->cells.cells().size());
      const SilentProgress progress;
      EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, 0, stage->plan.photons, progress,
                  map);
      const CellPatch& floor = stage->cells.patches()[stage->cells.PatchOf(kFloor)];
      double on_floor = 0;
      for (size_t i = 0; i < static_cast<size_t>(floor.width * floor.height); ++i) {
        on_floor += static_cast<double>(map.flux[2 * (floor.first_cell + i)].flux[1]) / stage->plan.fixed_point_scale;
      }
      return on_floor;
    });
    sum += flux;
    squares += flux * flux;
  }
  const double mean = sum / kSeeds;
  EXPECT_LT(std::sqrt(squares / kSeeds - mean * mean), 0.3 * mean);
}

}  // namespace
}  // namespace bakewell
