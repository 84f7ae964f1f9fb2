#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// A closed black room whose walls all emit radiance 1: irradiance pi everywhere.
Scene BlackFurnace() {
  SceneBuilder builder({48, 32});
  const int wall = builder.AddMaterial({0, 0, 0}, {1, 1, 1});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.material = wall, .page = {0, 0, 48, 32}});
  return builder.Build();
}

// A scene's photons in cells, and what they say.
struct CachedScene {
  PreparedLevel prepared;
  SurfaceCells cells;
  RadianceCache cache;

  CachedScene(const Scene& scene, int photons_per_cell, uint32_t seed)
      : prepared(PrepareInMemory(scene, {})), cells(SurfaceCells::Build(*prepared.world, 4096)) {
    const EmissionGuide guide =
        EmissionGuide::Learn(*prepared.world, *prepared.lights, prepared.layout, prepared.texels, 100, 0);
    const PhotonPlan plan =
        PlanPhotons(*prepared.lights, guide, static_cast<int64_t>(cells.cells().size()) * photons_per_cell, seed);
    PhotonMap map;
    map.flux.resize(2 * cells.cells().size());
    SilentProgress progress;
    EmitPhotons(*prepared.world, *prepared.lights, guide, cells, plan, 0, plan.photons, progress, map);
    cache = EstimateDensity(*prepared.world, cells, map, plan, {}, progress);
  }
};

// Area-weighted mean of the cache's front irradiance over flux / area.
double CacheMean(int photons_per_cell, uint32_t seed) {
  const CachedScene room(BlackFurnace(), photons_per_cell, seed);
  double sum = 0, area = 0;
  for (size_t i = 0; i < room.cells.cells().size(); ++i) {
    const auto a = static_cast<double>(room.cells.cells()[i].area);
    sum += a * static_cast<double>(room.cache.light[2 * i].irradiance.y);
    area += a;
  }
  return sum / (kPi * area);
}

TEST(RadianceCache, FewPhotonsPerCellAreNotBiased) {
  // The cache was 1 % too bright where neighbourhoods grew until they held enough photons: a neighbourhood that
  // happened to be bright stopped early. The flux is exact (every photon lands); smoothing moves it between cells of
  // uniform light, which leaves the mean within 1e-3 at 80,000 photons.
  for (const int photons_per_cell : {2, 5, 20, 40}) {
    EXPECT_NEAR(CacheMean(photons_per_cell, 0), 1, 3e-3) << photons_per_cell;
  }
}

// Symptom: a photon that falls on a chip of a few square millimetres is hundreds of means there, and a gather ray that
// meets the chip brought it home: one texel of a sunlit level was a million times too bright.
TEST(RadianceCache, ChipsSmallerThanACellAreNotRead) {
  TestRandom random(3);
  SceneBuilder builder;
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{8, 8, 8});
  builder.AddRoom({0, 0, 0}, {4, 3, 4}, {.material = 0, .page = {0, 0, 48, 32}});
  builder.AddQuad({1.5, 2.9, 1.5}, {1, 0, 0}, {0, 0, 1}, {.material = lamp, .lightmapped = false});
  for (int i = 0; i < 1500; ++i) {
    const auto place = [&] { return static_cast<double>(random.Between(0.3f, 2.7f)); };
    const Vec3d a{place(), place(), place()};
    builder.AddTriangle(a, a + Vec3d{0.002, 0, 0}, a + Vec3d{0, 0, -0.002}, {.lightmapped = false});
  }
  const CachedScene chips(builder.Build(), 70, 0);
  float most = 0, brightest = 0;
  for (const CachedLight& light : chips.cache.light) {
    float& brighter = light.window == 0 ? brightest : most;
    brighter = std::max(brighter, Luminance(light.irradiance));
  }
  EXPECT_GT(brightest, 50.0f);  // some photon met a chip
  EXPECT_LT(most, 20.0f);       // the lamp's own irradiance at its edge is 8 pi / 2
}

// A small room of one lamp and a block, 8 x 12 texels of which matter.
Scene SmallRoom() {
  SceneBuilder builder({12, 8});
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{8, 8, 8});
  builder.AddRoom({0, 0, 0}, {3, 2.5, 3}, {.material = 0, .page = {0, 0, 12, 8}});
  builder.AddQuad({1.2, 2.4, 1.3}, {0.6, 0, 0}, {0, 0, 0.5}, {.material = lamp, .lightmapped = false});
  builder.AddBox({0.7, 0, 0.6}, {1.4, 0.9, 1.3}, {.material = 0, .lightmapped = false});
  return builder.Build();
}

std::vector<double> LuminancesWith(const Scene& scene, int samples, bool filter) {
  BakeSettings settings;
  settings.filter = filter;
  settings.min_samples = settings.max_samples = samples;
  settings.photons = 100000;
  const BakedScene result = BakeSceneInMemory(scene, settings);
  std::vector<double> luminances;
  for (const TexelLight& light : result.lights())
    luminances.push_back(static_cast<double>(Luminance(light.irradiance)));
  return luminances;
}

double Rms(const std::vector<double>& a, const std::vector<double>& b) {
  double square = 0;
  for (size_t i = 0; i < a.size(); ++i) square += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(square / static_cast<double>(a.size()));
}

// Slope of the line through (x, y) by least squares.
double Slope(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, xy = 0, xx = 0;
  for (size_t i = 0; i < x.size(); ++i) mean_x += x[i] / n, mean_y += y[i] / n;
  for (size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    xx += (x[i] - mean_x) * (x[i] - mean_x);
  }
  return xy / xx;
}

TEST(Convergence, ErrorFallsAtLeastWithTheRootOfTheSamples) {
  const Scene scene = SmallRoom();
  // 16 times the most samples: what it lacks itself changes the slope by less than 0.01.
  const std::vector<double> limit = LuminancesWith(scene, 16384, false);
  std::vector<double> log_samples, log_raw, log_filtered;
  for (int samples = 16; samples <= 1024; samples *= 2) {
    log_samples.push_back(std::log(samples));
    log_raw.push_back(std::log(Rms(LuminancesWith(scene, samples, false), limit)));
    log_filtered.push_back(std::log(Rms(LuminancesWith(scene, samples, true), limit)));
  }
  const double slope = Slope(log_samples, log_raw);
  EXPECT_LE(slope, -0.5) << "error " << std::exp(log_raw.front()) << " to " << std::exp(log_raw.back());
  // Filtered, the error begins lower, where there is noise to take away, and goes on falling.
  EXPECT_LT(log_filtered.front(), log_raw.front()) << "16 samples";
  for (size_t i = 1; i < log_filtered.size(); ++i) EXPECT_LT(log_filtered[i], log_filtered[i - 1] - 0.15) << i;
}

// Tiles of 2 x 2 texels, each a chart of its own, below a plate with a hole over a third of every other texel's
// footprint, each way; the sun reaches half of what is left open.
Scene FloorUnderHoles() {
  constexpr int kSide = 24;
  SceneBuilder builder({kSide, kSide});
  for (int x = 0; x < kSide; x += 2) {
    for (int z = 0; z < kSide; z += 2) {
      const PageRect rect{static_cast<float>(z), static_cast<float>(x), 2, 2};
      builder.AddQuad({1.0 * x, 0, 1.0 * z}, {0, 0, 2}, {2, 0, 0}, {.material = 0, .page = rect});
    }
  }
  const auto plate = [&](double x0, double x1, double z0, double z1) {
    builder.AddBox({x0, -0.5, z0}, {x1, 0.3, z1}, {.material = 0, .lightmapped = false});
  };
  for (int i = 0; i <= kSide; i += 2) {
    const double hole = i + 0.1, before = i == 0 ? -1 : hole - 1.55;  // holes are 0.45 wide, 0.3 of it in the footprint
    plate(-1, kSide + 1, before, hole);
    for (int k = 0; i < kSide && k <= kSide; k += 2) plate(k == 0 ? -1 : k - 1.45, k + 0.1, hole, hole + 0.45);
  }
  builder.AddDirectionalLight({0.75, -1, 0}, {3, 3, 3});
  return builder.Build();
}

// Symptom: where other geometry leaves a third of a texel and all texels around it lie inside, the four samples of the
// first round were one or two, found no sun, had no spread, and that was that: one texel of a cluttered room made a
// quarter of its error at 2 %.
TEST(Convergence, TexelsPartlyInsideOtherGeometryDoNotMissTheSun) {
  const Scene scene = FloorUnderHoles();
  const BakedScene few = BakeSceneInMemory(scene, {});
  const std::vector<double> many = LuminancesWith(scene, 1024, false);
  int divided = 0;
  for (size_t i = 0; i < many.size(); ++i) {
    if (!few.lights()[i].valid || !(many[i] > 0.3)) continue;
    ++divided;
    const auto light = static_cast<double>(Luminance(few.lights()[i].irradiance));
    EXPECT_NEAR(light / many[i], 1, 0.5) << few.texels()[i].x << " " << few.texels()[i].y;
  }
  EXPECT_GT(divided, 100);
}

// The floor of a room: 4 x 4 pieces of 2 x 2 m and 8 x 8 texels, each a chart of its own. Element 32 y + x: irradiance
// of the floor's texel.
std::vector<double> ModularFloor(int samples, uint32_t seed) {
  constexpr int kPieces = 4, kTexels = 8;
  SceneBuilder builder({64, 64});
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{8, 8, 8});
  builder.AddRoom({0, -0.5, -8}, {8, 3, 0}, {.lightmapped = false});
  builder.AddBox({2.5, 0, -3.5}, {3.5, 1, -2.5}, {.lightmapped = false});
  builder.AddQuad({5, 2.9, -6}, {1, 0, 0}, {0, 0, 1}, {.material = lamp, .lightmapped = false});
  for (int x = 0; x < kPieces; ++x) {
    for (int y = 0; y < kPieces; ++y) {
      const PageRect rect{2.0f + 16.0f * static_cast<float>(x), 2.0f + 16.0f * static_cast<float>(y), kTexels, kTexels};
      builder.AddQuad({2.0 * x, 0, -2.0 * y}, {2, 0, 0}, {0, 0, -2}, {.page = rect});
    }
  }
  BakeSettings settings;
  settings.min_samples = settings.max_samples = samples;
  settings.photons = 100000;
  settings.seed = seed;
  const BakedScene baked = BakeSceneInMemory(builder.Build(), settings);
  constexpr int kSide = kPieces * kTexels;
  std::vector<double> floor(kSide * kSide);
  const Vec3f origin = baked.texels().front().position;
  for (size_t i = 0; i < baked.texels().size(); ++i) {
    const Vec3f place = (baked.texels()[i].position - origin) * 4.0f;
    const auto x = static_cast<size_t>(place.x + 0.5f), y = static_cast<size_t>(0.5f - place.z);
    floor[y * kSide + x] = static_cast<double>(Luminance(baked.lights()[i].irradiance));
  }
  return floor;
}

// Symptom: the pieces of a modular floor could be told apart at preview.
TEST(Convergence, PiecesOfAFloorLookLikeOne) {
  constexpr size_t kSide = 32, kPiece = 8;
  const std::vector<double> limit = ModularFloor(1024, 0);
  double between = 0, within = 0;
  int between_count = 0, within_count = 0;
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    std::vector<double> error = ModularFloor(4, seed);
    for (size_t i = 0; i < error.size(); ++i) error[i] -= limit[i];
    for (size_t y = 0; y < kSide; ++y) {
      for (size_t x = 1; x < kSide; ++x) {
        for (const double step :
             {error[y * kSide + x] - error[y * kSide + x - 1], error[x * kSide + y] - error[(x - 1) * kSide + y]}) {
          (x % kPiece == 0 ? between : within) += step * step;
          (x % kPiece == 0 ? between_count : within_count) += 1;
        }
      }
    }
  }
  EXPECT_LT(between / between_count, 2.5 * within / within_count);  // 3.0 where charts keep to themselves
}

}  // namespace
}  // namespace bakewell
