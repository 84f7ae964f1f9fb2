#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include "core/scene/canonical.h"
#include "tests/property/studio.h"
#include "tests/support/bake_scene.h"

// What a whole bake keeps when threads, batches, order, place, size and the set of lights change (issue 2, items 3 and
// 4).
namespace bakewell {
namespace {

BakeSettings FixedBudget(int samples, int64_t photons, uint32_t seed = 0) {
  BakeSettings settings;
  settings.min_samples = settings.max_samples = samples;
  settings.photons = photons;
  settings.seed = seed;
  return settings;
}

// The numbers of a texel that are written to disk.
std::array<float, 34> BytesOf(const TexelLight& light) {
  std::array<float, 34> values{};
  size_t n = 0;
  for (int c = 0; c < 3; ++c) {
    values[n++] = light.irradiance[c];
    values[n++] = light.variance[c];
    for (const Rgb& lambda : light.sh.lambda) values[n++] = lambda[c];
  }
  values[n] = light.backface_share;
  return values;
}

void ExpectSameBytes(const BakedScene& a, const BakedScene& b) {
  ASSERT_EQ(a.lights().size(), b.lights().size());
  ASSERT_GT(a.lights().size(), 500u);
  size_t different = 0;
  for (size_t i = 0; i < a.lights().size(); ++i) {
    const auto x = BytesOf(a.lights()[i]), y = BytesOf(b.lights()[i]);
    different += std::memcmp(x.data(), y.data(), sizeof x) == 0 ? 0 : 1;
    ASSERT_EQ(std::pair(a.texels()[i].x, a.texels()[i].y), std::pair(b.texels()[i].x, b.texels()[i].y));
  }
  EXPECT_EQ(different, 0u) << "texels of " << a.lights().size();
}

BakedScene BakeWithThreads(const Scene& scene, const BakeSettings& settings, size_t threads) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
  return BakeSceneInMemory(scene, settings);
}

TEST(Determinism, ThreadsChangeNoByte) {
  // The target lets texels stop at different times: what their neighbours decided must not matter either.
  BakeSettings settings = FixedBudget(64, 40000);
  settings.min_samples = 16;
  settings.target_error = 0.05f;
  const Scene scene = Studio();
  ExpectSameBytes(BakeWithThreads(scene, settings, 1), BakeWithThreads(scene, settings, 2));
}

TEST(Determinism, PhotonBatchesChangeNoByte) {
  BakeSettings settings = FixedBudget(16, 40000);
  const Scene scene = Studio();
  settings.photon_batches = 8;
  const BakedScene eight = BakeSceneInMemory(scene, settings);
  settings.photon_batches = 64;
  ExpectSameBytes(eight, BakeSceneInMemory(scene, settings));
}

// Objects, lights and materials in an order of `seed`.
Scene Shuffled(Scene scene, uint32_t seed) {
  std::mt19937 random(seed);
  std::shuffle(scene.objects.begin(), scene.objects.end(), random);
  std::shuffle(scene.lights.begin(), scene.lights.end(), random);
  std::vector<int> from(scene.materials.size());
  for (size_t i = 0; i < from.size(); ++i) from[i] = static_cast<int>(i);
  std::shuffle(from.begin(), from.end(), random);
  std::vector<Material> materials;
  for (const int i : from) materials.push_back(scene.materials[i]);
  for (Object& object : scene.objects) {
    object.material = static_cast<int>(std::find(from.begin(), from.end(), object.material) - from.begin());
  }
  scene.materials = materials;
  return scene;
}

TEST(Determinism, OrderOfObjectsLightsAndMaterialsChangesNoByte) {
  const BakeSettings settings = FixedBudget(16, 40000);
  Scene scene = Studio();
  Canonicalize(scene);
  const BakedScene straight = BakeSceneInMemory(scene, settings);
  for (const uint32_t seed : {1u, 2u}) {
    Scene shuffled = Shuffled(Studio(), seed);
    Canonicalize(shuffled);
    ExpectSameBytes(straight, BakeSceneInMemory(shuffled, settings));
  }
}

TEST(Determinism, AnotherSeedChangesTexels) {
  const Scene scene = Studio();
  const BakedScene a = BakeSceneInMemory(scene, FixedBudget(8, 4000, 0));
  const BakedScene b = BakeSceneInMemory(scene, FixedBudget(8, 4000, 1));
  size_t same = 0;
  for (size_t i = 0; i < a.lights().size(); ++i) same += BytesOf(a.lights()[i]) == BytesOf(b.lights()[i]) ? 1 : 0;
  EXPECT_LT(same, a.lights().size() / 100);
}

double LuminanceOf(const TexelLight& light) { return static_cast<double>(Luminance(light.irradiance)); }

// The variances are per channel; those of the three channels of one texel are correlated, so the luminance's is
// bounded by that of the weighted standard deviations.
double VarianceOf(const TexelLight& light) {
  const auto deviation = [&](int c) { return std::sqrt(static_cast<double>(light.variance[c])); };
  const double sum = 0.2126 * deviation(0) + 0.7152 * deviation(1) + 0.0722 * deviation(2);
  return sum * sum;
}

// How far two estimates of the same texels are apart, in their own standard deviations.
struct ZTest {
  double sum = 0, difference = 0, z2 = 0, count = 0;
  int wild = 0;  // beyond 5 standard deviations: one in two million by chance

  void Add(double expected, double found, double variance) {
    const double z = (found - expected) / std::sqrt(variance);
    sum += expected;
    difference += found - expected;
    z2 += z * z;
    count += 1;
    wild += std::fabs(z) > 5 ? 1 : 0;
  }
  // Standard errors err on the safe side, but not by more than twice.
  void Expect(double mean_tolerance) const {
    EXPECT_LT(z2 / count, 1);
    EXPECT_GT(z2 / count, 0.25);
    EXPECT_EQ(wild, 0);
    EXPECT_NEAR(difference / sum, 0, mean_tolerance);
  }
};

void ExpectLinear(const StudioLights& a, const StudioLights& b, const StudioLights& both, int samples, int64_t photons,
                  double mean_tolerance) {
  // Different seeds: the three bakes are independent, so that their variances add.
  const BakedScene apart_a = BakeSceneInMemory(Studio({}, a), FixedBudget(samples, photons, 1));
  const BakedScene apart_b = BakeSceneInMemory(Studio({}, b), FixedBudget(samples, photons, 2));
  const BakedScene together = BakeSceneInMemory(Studio({}, both), FixedBudget(samples, photons, 3));
  ASSERT_EQ(apart_a.lights().size(), together.lights().size());
  ASSERT_EQ(apart_b.lights().size(), together.lights().size());
  ZTest test;
  for (size_t i = 0; i < together.lights().size(); ++i) {
    const TexelLight &x = apart_a.lights()[i], &y = apart_b.lights()[i], &t = together.lights()[i];
    test.Add(LuminanceOf(x) + LuminanceOf(y), LuminanceOf(t), VarianceOf(x) + VarianceOf(y) + VarianceOf(t));
  }
  EXPECT_GT(test.z2 / test.count, 0.05) << "variances that large say nothing";
  test.Expect(mean_tolerance);
}

TEST(Linearity, LightsInsideBakedApartAddUpToThemTogether) {
  StudioLights a{.point = true, .spot = false, .panel = false, .sun = false, .sky = false};
  StudioLights b{.point = false, .spot = true, .panel = true, .sun = false, .sky = false};
  StudioLights both{.point = true, .spot = true, .panel = true, .sun = false, .sky = false};
  // Eight such triples: the gather's noise (falls with the samples) and that of the photons, which is common to all
  // texels, gave the mean a standard deviation of 0.14 %.
  ExpectLinear(a, b, both, 256, 200000, 6e-3);
}

TEST(Linearity, SunAndSkyAndLampsBakedApartAddUpToThemTogether) {
  StudioLights a{.point = true, .spot = false, .panel = false, .sun = true, .sky = false};
  StudioLights b{.point = false, .spot = true, .panel = true, .sun = false, .sky = true};
  // The photons' noise is common to all texels: the mean of six such triples had a standard deviation of 0.5 %.
  ExpectLinear(a, b, {}, 64, 400000, 0.02);
}

// Root mean square of the differences of two bakes of one studio, over their mean.
double RelativeRms(const BakedScene& a, const BakedScene& b) {
  EXPECT_EQ(a.lights().size(), b.lights().size());
  double square = 0, sum = 0;
  for (size_t i = 0; i < std::min(a.lights().size(), b.lights().size()); ++i) {
    const double d = LuminanceOf(a.lights()[i]) - LuminanceOf(b.lights()[i]);
    square += d * d;
    sum += LuminanceOf(a.lights()[i]);
  }
  return std::sqrt(square * static_cast<double>(a.lights().size())) / sum;
}

BakedScene BakeAt(const Placement& placement, const StudioLights& on = {}) {
  Scene scene = Studio(placement, on);
  Canonicalize(scene);
  return BakeSceneInMemory(scene, FixedBudget(64, 100000));
}

TEST(Invariance, MovedByTenKilometres) {
  EXPECT_LT(RelativeRms(BakeAt({}), BakeAt({.offset_m = {8000.1, 123.4, -6000.7}})), 1e-3);
}

TEST(Invariance, ScaledByPowersOfTwo) {
  const BakedScene one = BakeAt({});
  EXPECT_LT(RelativeRms(one, BakeAt({.scale = 0x1p10})), 1e-3);
  EXPECT_LT(RelativeRms(one, BakeAt({.scale = 0x1p-10})), 1e-3);
}

TEST(Invariance, TurnedAboutTheVertical) {
  const StudioLights no_sky{.sky = false};
  const BakedScene straight = BakeAt({}, no_sky);
  for (const double turn : {0.7, 2.5}) EXPECT_LT(RelativeRms(straight, BakeAt({.turn_rad = turn}, no_sky)), 1e-3);
}

TEST(Invariance, TurnedUnderASky) {
  const BakedScene straight = BakeAt({});
  for (const double turn : {0.7, 2.5}) EXPECT_LT(RelativeRms(straight, BakeAt({.turn_rad = turn})), 1e-3);
}

}  // namespace
}  // namespace bakewell
