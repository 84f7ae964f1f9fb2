#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

Scene Furnace(float albedo) {
  SceneBuilder builder({48, 32});
  const int wall = builder.AddMaterial({albedo, albedo, albedo}, {1, 1, 1});
  builder.AddRoom({0, 0, 0}, {3, 2, 4},
                  {.material = wall, .lightmapped = true, .page = {0, 0, 48, 32}, .name = "room"});
  return builder.Build();
}

// In a closed room of albedo rho and emitted radiance 1, E = pi/(1 - rho) everywhere, over all bounces (theory.md 3).
void ExpectFurnace(float albedo, int64_t photons, double mean_tolerance, double texel_tolerance) {
  BakeSettings settings;
  settings.min_samples = settings.max_samples = 1024;
  settings.photons = photons;
  const BakedScene result = BakeSceneInMemory(Furnace(albedo), settings);
  const double expected = kPi / (1 - static_cast<double>(albedo));
  double sum = 0, square = 0;
  for (const TexelLight& light : result.lights()) {
    const double value = static_cast<double>(light.irradiance.x) / expected;
    EXPECT_TRUE(light.valid);
    sum += value;
    square += (value - 1) * (value - 1);
  }
  const double n = static_cast<double>(result.lights().size());
  EXPECT_NEAR(sum / n, 1, mean_tolerance);
  EXPECT_LT(std::sqrt(square / n), texel_tolerance);
}

TEST(Furnace, HalfAlbedo) { ExpectFurnace(0.5f, 1000000, 1e-3, 1e-2); }
TEST(Furnace, NineTenthsAlbedo) { ExpectFurnace(0.9f, 1000000, 2e-3, 2e-2); }

TEST(PhotonMap, FluxIsConserved) {
  const PreparedLevel prepared = PrepareInMemory(Furnace(0.7f), {});
  const EmissionGuide guide =
      EmissionGuide::Learn(*prepared.world, *prepared.lights, prepared.layout, prepared.texels, 100, 0);
  const PhotonPlan plan = PlanPhotons(*prepared.lights, guide, 100000, 0);
  const SurfaceCells cells = SurfaceCells::Build(*prepared.world, 4096);
  PhotonMap map;
  map.flux.resize(2 * cells.cells().size());
  SilentProgress progress;
  EmitPhotons(*prepared.world, *prepared.lights, guide, cells, plan, 0, plan.photons, progress, map);
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(map.totals.emitted[c], map.totals.absorbed[c] + map.totals.escaped[c]);
    EXPECT_EQ(map.totals.escaped[c], 0);  // the room is closed
    const double flux = static_cast<double>(map.totals.emitted[c]) / plan.fixed_point_scale;
    EXPECT_NEAR(flux / (kPi * 52), 1, 1e-6);  // 52 m^2 of radiance 1
    int64_t deposited = 0;
    for (const CellFlux& cell : map.flux) deposited += cell.flux[c];
    EXPECT_NEAR(static_cast<double>(deposited) / static_cast<double>(map.totals.emitted[c]), 1 / (1 - 0.7), 0.03);
  }
  int64_t photons = 0;
  for (const CellFlux& cell : map.flux) photons += cell.count;
  EXPECT_EQ(photons, map.totals.deposits);  // every hit is deposited
  EXPECT_EQ(map.totals.deposits, map.totals.rays);
}

TEST(SurfaceCells, AreasAddUpToTheScenes) {
  const PreparedLevel prepared = PrepareInMemory(Furnace(0.5f), {});
  for (const int64_t target : {1, 100, 10000}) {
    const SurfaceCells cells = SurfaceCells::Build(*prepared.world, target);
    double area = 0;
    for (const SurfaceCell& cell : cells.cells()) area += static_cast<double>(cell.area);
    EXPECT_NEAR(area / 52, 1, 1e-5) << target;
  }
}

}  // namespace
}  // namespace bakewell
