#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "tests/property/stability/stress.h"
#include "worker/level/report.h"

// Lights at the ends of what a level may hold.
namespace bakewell {
namespace {

struct Lamp {
  Vec3d position;
  double intensity;
};

double Arriving(const Lamp& lamp, Vec3d p, Vec3d n) {
  const Vec3d to = lamp.position - p;
  return lamp.intensity * std::max(0.0, Dot(to, n)) / std::pow(Length(to), 3);
}

Rgb Grey(double x) {
  const float f = static_cast<float>(x);
  return {f, f, f};
}

// A texel's value is a mean over its area, the closed form that of its centre; and Sobol noise.
constexpr double kTexelTolerance = 5e-3;

TEST(Intensity, ChannelsSixteenDecadesApartAreEachRight) {
  SceneBuilder builder({32, 32});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.material = black, .page = {0, 0, 32, 32}});
  builder.AddPointLight({2, 3, 2}, {1e-8f, 1e8f, 1});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(64, 10000));
  const double intensities[3] = {1e-8, 1e8, 1};
  for (int c = 0; c < 3; ++c) {
    const Lamp lamp{{2, 3, 2}, intensities[c]};
    const Deviation d = Compare(
        baked, [&](Vec3d p, Vec3d n) { return Arriving(lamp, p, n); }, -1, c);
    EXPECT_LT(d.worst, kTexelTolerance) << c;
  }
}

TEST(Intensity, ADimLampBesideABrightOneAddsUp) {
  SceneBuilder builder({32, 32});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.material = black, .page = {0, 0, 32, 32}});
  const Lamp dim{{1, 2, 1}, 1e-8}, bright{{3, 2, 3}, 1e8};
  for (const Lamp& lamp : {dim, bright}) builder.AddPointLight(lamp.position, Grey(lamp.intensity));
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(64, 10000));
  const Deviation d = Compare(baked, [&](Vec3d p, Vec3d n) { return Arriving(dim, p, n) + Arriving(bright, p, n); });
  EXPECT_LT(d.worst, kTexelTolerance);
}

// Symptom: the lamp that nobody saw was 16 decades brighter and took every sample; the dim room had 0.16 of its light.
TEST(Intensity, ADimLampInASealedRoomIsFoundBesideABrightOneInTheNext) {
  SceneBuilder builder({64, 32});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  const Lamp dim{{2, 1.5, 2}, 1e-8}, bright{{12, 1.5, 2}, 1e8};
  int rooms[2];
  for (int k = 0; k < 2; ++k) {
    const float x = static_cast<float>(32 * k);
    rooms[k] = builder.AddRoom({10.0 * k, 0, 0}, {10.0 * k + 4, 3, 4}, {.material = black, .page = {x, 0, 30, 32}});
  }
  for (const Lamp& lamp : {dim, bright}) builder.AddPointLight(lamp.position, Grey(lamp.intensity));
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 10000));
  const Deviation in_bright = Compare(
      baked, [&](Vec3d p, Vec3d n) { return Arriving(bright, p, n); }, rooms[1]);
  const Deviation in_dim = Compare(
      baked, [&](Vec3d p, Vec3d n) { return Arriving(dim, p, n); }, rooms[0]);
  EXPECT_NEAR(in_bright.mean_ratio, 1, 0.01);
  EXPECT_NEAR(in_dim.mean_ratio, 1, 0.05);
}

// Mean irradiance of a closed grey room, over the lamp's intensity.
double MeanOverIntensity(float intensity) {
  SceneBuilder builder({16, 16});
  builder.AddRoom({0, 0, 0}, {3, 3, 3}, {.material = 0, .page = {0, 0, 16, 16}});
  builder.AddPointLight({1, 2, 1}, {intensity, intensity, intensity});
  BakeSettings settings = StressSettings(64, 10000);
  settings.filter = true;
  const BakedScene baked = BakeStress(builder.Build(), settings);
  return Compare(baked, [&](Vec3d, Vec3d) { return static_cast<double>(intensity); }).mean_ratio;
}

TEST(Intensity, OfAnyMagnitudeGivesTheSameLight) {
  const double one = MeanOverIntensity(1);
  // Scaling rounds the photons' fixed point anew, no more.
  for (const float intensity : {1e-15f, 1e-8f, 1e8f, 1e15f}) {
    EXPECT_NEAR(MeanOverIntensity(intensity) / one, 1, 1e-4) << intensity;
  }
}

// Symptom: variances were infinite or NaN, sampling stopped after the first round or never, and nothing was said.
TEST(Intensity, BeyondWhatVariancesHoldIsCountedAndFails) {
  SceneBuilder builder({16, 16});
  builder.AddRoom({0, 0, 0}, {3, 3, 3}, {.material = 0, .page = {0, 0, 16, 16}});
  builder.AddPointLight({1, 2, 1}, Grey(3e19));
  const BakedScene baked = BakeSceneInMemory(builder.Build(), {});
  for (const TexelLight& light : baked.lights()) {
    ASSERT_TRUE(IsFinite(light.irradiance) && IsFinite(light.variance)) << light.variance.x;
  }
  EXPECT_GT(baked.baked.counters.bad_samples, 0);
  BakeTally tally;
  tally.Count(baked.baked.counters);
  const auto report = tally.Finish({}, 0, {});
  ASSERT_EQ(report.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(report.status().message().find("above 1e+18"), std::string::npos) << report.status();
}

TEST(LightNearASurface, TexelsBesideItFollowTheClosedForm) {
  SceneBuilder builder({16, 16});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, {.material = black, .page = {0, 0, 16, 16}});
  // Above a texel's corner: at least half a texel, 0.06 m, from every sample point that is looked at.
  const Lamp lamp{{0.4375, 1e-4, 0.4375}, 1};
  builder.AddPointLight(lamp.position, Grey(1));
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 10000));
  int seen = 0;
  for (size_t i = 0; i < baked.texels().size(); ++i) {
    const Vec3d p = ToDouble(baked.texels()[i].position) + baked.prepared.level->scene.origin_ws;
    const double right = Arriving(lamp, p, {0, 1, 0});
    if (Length(p - lamp.position) < 0.5) continue;
    // 1 / r^3 over a texel of an eighth of r.
    EXPECT_NEAR(static_cast<double>(baked.lights()[i].irradiance.x) / right, 1, 0.05);
    ++seen;
  }
  EXPECT_GT(seen, 100);
}

TEST(LightNearASurface, TheWallBehindItReflectsHalfItsFlux) {
  // The half of the light that meets the wall does so in a spot of millimetres: seen from afar a disc that radiates
  // 2 rho I cos(angle), theory of a Lambertian point.
  constexpr double kAlbedo = 0.8;
  SceneBuilder builder({24, 24});
  const int black = builder.AddMaterial(Rgb{0, 0, 0}), white = builder.AddMaterial(Grey(kAlbedo));
  builder.AddQuad({0, 0, -1}, {0, 2, 0}, {0, 0, 2}, {.material = white, .lightmapped = false});  // faces +x
  const int floor = builder.AddQuad({0.5, 0, -1}, {0, 0, 2}, {2, 0, 0}, {.material = black, .page = {0, 0, 12, 12}});
  const Lamp lamp{{1e-4, 1, 0}, 1};
  builder.AddPointLight(lamp.position, Grey(1));
  BakeSettings settings = StressSettings(8192, 5000);
  const auto expected = [&](Vec3d p, Vec3d n) {
    const Vec3d to = lamp.position - p;
    return Arriving(lamp, p, n) * (1 + 2 * kAlbedo * -to.x / Length(to));
  };
  double mean = 0;
  for (settings.seed = 0; settings.seed < 8; ++settings.seed) {
    const BakedScene baked = BakeStress(builder.Build(), settings);
    mean += Compare(baked, expected, floor).mean_ratio / 8;
  }
  // Few rays find the spot: one bake's ratio has a standard deviation of 2.5 %, eight bakes' mean one of 0.9 %.
  EXPECT_NEAR(mean, 1, 0.027);
}

TEST(LightInsideGeometry, ShinesOnNothingOutside) {
  SceneBuilder builder({48, 32});
  const int grey = builder.AddMaterial(Grey(0.7));
  const int floor = builder.AddQuad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, {.material = grey, .page = {0, 0, 24, 24}});
  const int box = builder.AddBox({-0.5, 0.25, -0.5}, {0.5, 1.25, 0.5}, {.material = grey, .page = {24, 0, 24, 16}});
  builder.AddPointLight({0.1, 0.7, 0.2}, Grey(1000));
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 100000));
  for (const int object : {floor, box}) {
    EXPECT_EQ(Compare(
                  baked, [](Vec3d, Vec3d) { return 1.0; }, object)
                  .brightest,
              0)
        << object;
  }
}

TEST(ZeroLights, GiveZeroAndTraceNoPhoton) {
  SceneBuilder builder({64, 32});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.material = 0, .page = {0, 0, 48, 32}});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(16, 1000000));
  EXPECT_EQ(baked.baked.photons, 0);
  EXPECT_EQ(baked.baked.photon_rays, 0);
  EXPECT_EQ(baked.baked.counters.shadow_rays, 0);
  EXPECT_EQ(Compare(baked, [](Vec3d, Vec3d) { return 1.0; }).brightest, 0);
}

TEST(ManyLights, AHundredThousandAddUpInSeconds) {
  const auto start = std::chrono::steady_clock::now();
  SceneBuilder builder({24, 24});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad({0, 0, 0}, {0, 0, 10}, {10, 0, 0}, {.material = black, .page = {0, 0, 24, 24}});
  std::vector<Lamp> lamps;
  for (int i = 0; i < 100000; ++i) {
    // Two additive recurrences and one for the height.
    const double n = i + 1, x = std::fmod(n * 0.7548776662466927, 1), z = std::fmod(n * 0.5698402909980532, 1);
    lamps.push_back({{10 * x, 1 + 2 * std::fmod(n * 0.6180339887498949, 1), 10 * z}, 1e-3 * (1 + i % 7)});
    builder.AddPointLight(lamps.back().position, Grey(lamps.back().intensity));
  }
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 10000));
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  const Deviation d = Compare(baked, [&](Vec3d p, Vec3d n) {
    double sum = 0;
    for (const Lamp& lamp : lamps) sum += Arriving(lamp, p, n);
    return sum;
  });
  // 24 x 24 texels of 256 samples: noise of a few percent a texel falls to 0.2 % in the mean.
  EXPECT_NEAR(d.mean_ratio, 1, 5e-3);
  EXPECT_LT(d.worst, 0.25);
  EXPECT_LT(taken.count(), 30) << "a square in the number of lights would take minutes";
}

// E = pi L / (1 - rho) in a closed room that glows.
void ExpectFurnace(float albedo, double counted_albedo, double tolerance) {
  SceneBuilder builder({24, 16});
  const int wall = builder.AddMaterial({albedo, albedo, albedo}, {1, 1, 1});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.material = wall, .page = {0, 0, 24, 16}});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 100000));
  const Deviation d = Compare(baked, [&](Vec3d, Vec3d) { return kPi / (1 - counted_albedo); });
  EXPECT_NEAR(d.mean_ratio, 1, tolerance) << albedo;
}

TEST(Albedo, BlackReflectsNothing) { ExpectFurnace(0, 0, 1e-3); }
// Symptom: photons stopped after 128 bounces, which left the room 7.5 % too dark. Paths have 50 bounces on average.
TEST(Albedo, NearlyWhiteReflectsFiftyTimes) { ExpectFurnace(0.98f, 0.98, 0.02); }
TEST(Albedo, WhiteAndBrighterAreClamped) {
  ExpectFurnace(1, 0.98, 0.02);
  ExpectFurnace(7, 0.98, 0.02);
}

}  // namespace
}  // namespace bakewell
