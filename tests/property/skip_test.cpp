#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/skip_levels.h"
#include "tests/support/statistics.h"
#include "worker/texel/texels.h"

// What a bake leaves out changes nothing that matters: the same bytes where that is exact, less than the target where
// it is a matter of chance, and an audit that notices where it is wrong.
namespace bakewell {
namespace {

BakeSettings Without(std::initializer_list<Skip> kinds) {
  BakeSettings settings;
  for (const Skip kind : kinds) settings.no_skip.Add(kind);
  return settings;
}

// Irradiance, SH and variance; not the share of back faces, which fewer rays tell where nothing is gathered.
bool SameLight(const TexelLight& a, const TexelLight& b) {
  return std::memcmp(&a.irradiance, &b.irradiance, sizeof a.irradiance) == 0 &&
         std::memcmp(&a.sh, &b.sh, sizeof a.sh) == 0 && std::memcmp(&a.variance, &b.variance, sizeof a.variance) == 0;
}

size_t Different(std::span<const TexelLight> a, std::span<const TexelLight> b) {
  size_t different = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) different += SameLight(a[i], b[i]) ? 0 : 1;
  return different;
}

void ExpectExact(const Scene& scene, Skip kind, double least_share, const BakeSettings& settings = {}) {
  BakeSettings without = settings;
  without.no_skip.Add(kind);
  const BakedScene on = BakeSceneInMemory(scene, settings), off = BakeSceneInMemory(scene, without);
  const SkipCount &skipped = on.baked.counters.skip.kind[static_cast<size_t>(kind)],
                  &none = off.baked.counters.skip.kind[static_cast<size_t>(kind)];
  EXPECT_GT(static_cast<double>(skipped.skipped), least_share * static_cast<double>(skipped.of));
  EXPECT_EQ(none.skipped, 0);
  EXPECT_LT(on.baked.counters.light_rays(), off.baked.counters.light_rays());
  EXPECT_EQ(Different(on.lights(), off.lights()), 0u) << "texels of " << on.lights().size();
}

TEST(Skip, LevelWithoutLightIsBlackWithoutGathering) { ExpectExact(RoomsLevel(64, 0), Skip::kNoLight, 0.99); }

// Photons are the evidence of darkness.
TEST(Skip, SealedRoomsWithoutLightAreLeftOut) {
  BakeSettings settings;
  settings.photons = 210000;  // enough to be sure of what is dimmer than a texel tolerates
  ExpectExact(RoomsLevel(96, 1), Skip::kDarkCharts, 0.7, settings);
}

// What the first round did not find is left out of the others, if there are any.
TEST(Skip, SunAndSkyAreLeftOutWhereNoSkyIsSeen) {
  BakeSettings settings;
  settings.target_error = 0.01f;
  ExpectExact(BunkerLevel(128), Skip::kUnseenSky, 0.3, settings);
}

TEST(Skip, ThreadsChangeNeitherLightNorCounts) {
  const Scene scene = RoomsLevel(96, 2);
  std::vector<BakedScene> baked;
  for (const size_t threads : {size_t{1}, size_t{2}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    baked.push_back(BakeSceneInMemory(scene, {}));
  }
  EXPECT_EQ(Different(baked[0].lights(), baked[1].lights()), 0u);
  EXPECT_EQ(Serialize(baked[0].baked.counters.skip), Serialize(baked[1].baked.counters.skip));
  EXPECT_GT(baked[0].baked.counters.skip.audited, 16);
}

double RelativeRms(std::span<const TexelLight> a, std::span<const TexelLight> b) {
  double square = 0, sum = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double of_b = static_cast<double>(Luminance(b[i].irradiance));
    square += std::pow(static_cast<double>(Luminance(a[i].irradiance)) - of_b, 2);
    sum += of_b;
  }
  return std::sqrt(square * static_cast<double>(a.size())) / sum;
}

TEST(Skip, EverythingTogetherStaysWithinTheTarget) {
  for (const Scene& scene : {SlitLevel(96, 0.02), BunkerLevel(96), SpotsLevel(64)}) {
    BakeSettings none;
    none.no_skip = SkipSet::All();
    const BakedScene on = BakeSceneInMemory(scene, {}), off = BakeSceneInMemory(scene, none);
    // Medium quality asks for 4 %, of either: they differ by no more than both together.
    EXPECT_LT(RelativeRms(on.lights(), off.lights()), 0.04 * std::sqrt(2.0));
  }
}

// A cellar with a lamp a millionth as bright as the one upstairs: no photon goes there, and all that there is of light
// lies far below what the bake's mean tolerates.
TEST(Skip, DimRoomsKeepTheirOwnLight) {
  SceneBuilder builder({64, 32});
  for (int k = 0; k < 2; ++k) {
    const float x = static_cast<float>(32 * k);
    builder.AddRoom({10.0 * k, 0, 0}, {10.0 * k + 4, 3, 4}, {.material = 0, .page = {x, 0, 32, 32}});
    const float intensity = k == 0 ? 1 : 1e-6f;
    builder.AddPointLight({10.0 * k + 2, 1.5, 2}, {intensity, intensity, intensity});
  }
  const Scene scene = builder.Build();
  // Cells that no photon met are black with or without: that is the photons' limit.
  const BakeSettings none = Without({Skip::kDarkCharts, Skip::kCulledLights});
  const BakedScene on = BakeSceneInMemory(scene, {}), off = BakeSceneInMemory(scene, none);
  double with = 0, without = 0;
  for (size_t i = 0; i < on.lights().size(); ++i) {
    if (on.texels()[i].x < 32) continue;
    with += static_cast<double>(Luminance(on.lights()[i].irradiance));
    without += static_cast<double>(Luminance(off.lights()[i].irradiance));
  }
  EXPECT_GT(without, 0);
  EXPECT_NEAR(with / without, 1, 1e-6);
}

// A gather whose photons are few and said to carry next to nothing: wherever none landed counts as dark for sure.
struct Fooled {
  PreparedLevel prepared;
  SurfaceCells cells;
  RadianceCache cache;
  GatherOptions options;

  Fooled(const Scene& scene, int64_t photons) : prepared(PrepareInMemory(scene, {})) {
    cells = SurfaceCells::Build(*prepared.world, CellsFor(photons));
    const EmissionGuide guide =
        EmissionGuide::Learn(*prepared.world, *prepared.lights, prepared.layout, prepared.texels, 10, 0);
    const PhotonPlan plan = PlanPhotons(*prepared.lights, guide, photons, 0);
    PhotonMap map;
    map.flux.resize(2 * cells.cells().size());
    SilentProgress progress;
    EmitPhotons(*prepared.world, *prepared.lights, guide, cells, plan, 0, plan.photons, progress, map);
    cache = EstimateDensity(*prepared.world, cells, map, plan, {}, progress);
    options = BudgetOf({}, std::ssize(prepared.texels.texels)).gather;
    options.mean_irradiance = MeanIrradiance(prepared.texels, cells, cache);
    options.photon_flux = 1e-9f * MeanPhotonFlux(cells, cache);
  }

  std::vector<TexelLight> Gather(const SkipSet& no_skip, SkipTally& tally) {
    const LightTree tree(*prepared.lights);
    const GatherScene scene{*prepared.world, *prepared.lights, tree, cells, cache};
    options.no_skip = no_skip;
    GatherCounters counters;
    std::vector<TexelLight> lights;
    for (int tile = 0; tile < prepared.texels.tile_count(); ++tile) {
      const auto made = GatherTile(scene, prepared.layout, prepared.texels, tile, options, counters);
      lights.insert(lights.end(), made.begin(), made.end());
    }
    tally = counters.skip;
    return lights;
  }
};

TEST(SkipAudit, TilesThatTurnOutToBeLitAreComputedInFull) {
  Fooled level(RoomsLevel(64, 10), 300);
  SkipSet full;
  full.Add(Skip::kDarkCharts);
  SkipTally fooled, none;
  const auto skipped = level.Gather({}, fooled), wanted = level.Gather(full, none);
  EXPECT_EQ(none.audited, 0);
  EXPECT_GE(fooled.audited, 16);
  EXPECT_GT(fooled.failed_over, 0);
  EXPECT_GT(fooled.found_ppm, 100000) << "light of a tenth of the mean was to be left out";
  // Tiles that failed over have the same bytes as without skipping; the others may have lost texels that no lot fell
  // on.
  EXPECT_LT(Different(skipped, wanted), skipped.size() / 20);
  EXPECT_LT(RelativeRms(skipped, wanted), 0.04);
}

TEST(SkipAudit, WhatTheSamePhotonsReallySayIsNotFooled) {
  Fooled level(RoomsLevel(64, 10), 300);
  level.options.photon_flux *= 1e9f;
  SkipTally tally;
  level.Gather({}, tally);
  EXPECT_EQ(tally[Skip::kDarkCharts].skipped, 0) << "300 photons are no evidence";
  EXPECT_EQ(tally.failed_over, 0);
}

TEST(Skip, AlphaThatIsTheSameToEveryRayChangesNoHit) {
  const Scene scene = FoliageLevel(32);
  SkipSet off;
  off.Add(Skip::kOpaqueAlpha);
  const auto sorted = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  const auto asked = World::Build(scene, BackfaceMode::kReflect, 0.98f, off).value();
  EXPECT_EQ(sorted->opaque_alpha().of, 2800);
  EXPECT_GE(sorted->opaque_alpha().skipped, 1200) << "the trunks";
  EXPECT_LT(sorted->opaque_alpha().skipped, 2800);
  EXPECT_EQ(asked->opaque_alpha().skipped, 0);
  TestRandom random(5);
  int hits = 0;
  for (int i = 0; i < 50000; ++i) {
    const Ray ray{random.InCube(20), random.Direction(), std::numeric_limits<float>::infinity(),
                  static_cast<uint32_t>(i)};
    const Hit a = sorted->Intersect(ray), b = asked->Intersect(ray);
    ASSERT_EQ(a.triangle, b.triangle) << i;
    ASSERT_EQ(a.t, b.t) << i;
    ASSERT_EQ(sorted->Occluded(ray), asked->Occluded(ray)) << i;
    hits += a && a.triangle >= 2 ? 1 : 0;
  }
  EXPECT_GT(hits, 1000) << "of trees";
}

}  // namespace
}  // namespace bakewell
