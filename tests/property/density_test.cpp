#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client/local/signal_density.h"
#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

// What --density signal does to a level.
namespace bakewell {
namespace {

constexpr size_t kShadowed = 0, kPlain = 1;

// Two plates of 4 m side by side under a sky; a lamp and a bar throw a shadow on the first.
Scene TwoPlates(float plain_density = 1) {
  SceneBuilder builder;
  builder.AddQuad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.name = "shadowed"});
  builder.AddQuad({40, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.name = "plain"});
  builder.AddBox({1.5, 0.5, 0}, {2, 0.6, 4}, {.lightmapped = false, .name = "bar"});
  builder.AddSpotLight({2, 3, 2}, {0, -1, 0}, {30, 30, 30}, 0.9, 1.0);
  builder.SetConstantSky({0.2f, 0.2f, 0.2f});
  Scene scene = builder.Build();
  scene.objects[kPlain].density = plain_density;
  return scene;
}

PreparedLevel Prepare(const Scene& scene, DensityMode density, int resolution = 0) {
  LoadedLevel level;
  level.scene = scene;
  BakeSettings settings;
  settings.uv = UvMode::kGenerate;
  settings.quality = Quality::kPreview;
  settings.density = density;
  settings.resolution = resolution;
  if (resolution == 0) settings.texels_per_metre = 20;
  PhaseClock clock;
  SilentProgress progress;
  auto prepared = PrepareLevel(std::move(level), settings, clock, progress);
  EXPECT_TRUE(prepared.ok()) << prepared.status();
  return *std::move(prepared);
}

// Texels a metre of an object, from the texels that it got.
double DensityOf(const PreparedLevel& prepared, size_t object) {
  double texels = 0, area = 0;
  for (const Texel& texel : prepared.texels.texels) {
    if (prepared.layout.charts[texel.chart].object != static_cast<int>(object)) continue;
    texels += double{texel.coverage};
    area += double{texel.area};
  }
  return std::sqrt(texels / area);
}

TEST(SignalDensity, ShadowEdgesGetTexelsFromFlatChartsWithinTheBudget) {
  const Scene scene = TwoPlates();
  const PreparedLevel uniform = Prepare(scene, DensityMode::kUniform), signal = Prepare(scene, DensityMode::kSignal);
  const double before = static_cast<double>(uniform.texels.texels.size());
  EXPECT_NEAR(static_cast<double>(signal.texels.texels.size()), before, 0.02 * before);
  EXPECT_GT(DensityOf(signal, kShadowed), 1.2 * DensityOf(uniform, kShadowed));
  EXPECT_LT(DensityOf(signal, kPlain), 0.7 * DensityOf(uniform, kPlain));
}

TEST(SignalDensity, AFixedPageIsKept) {
  const PreparedLevel signal = Prepare(TwoPlates(), DensityMode::kSignal, 64);
  EXPECT_EQ(signal.layout.pages, (std::vector<PageSize>{{64, 64}}));
  EXPECT_GT(DensityOf(signal, kShadowed), 1.5 * DensityOf(signal, kPlain));
}

TEST(SignalDensity, AnObjectsOwnFactorStillHolds) {
  const PreparedLevel once = Prepare(TwoPlates(), DensityMode::kUniform),
                      twice = Prepare(TwoPlates(2), DensityMode::kUniform),
                      signal = Prepare(TwoPlates(2), DensityMode::kSignal),
                      signal_once = Prepare(TwoPlates(), DensityMode::kSignal);
  // Rectangles are snapped to whole texels, by half a percent at most.
  EXPECT_NEAR(DensityOf(twice, kPlain) / DensityOf(once, kPlain), 2, 0.02);
  EXPECT_NEAR(DensityOf(twice, kShadowed) / DensityOf(once, kShadowed), 1, 0.01);
  EXPECT_GT(DensityOf(signal, kPlain) / DensityOf(signal, kShadowed),
            1.5 * DensityOf(signal_once, kPlain) / DensityOf(signal_once, kShadowed));
}

TEST(SignalDensity, HalfOfTheNoiseIsNoSignal) {
  TexelMap map;
  map.pages = {{32, 32}};
  map.texel_at.assign(1, std::vector<int32_t>(32 * 32));
  std::vector<TexelLight> lights;
  std::mt19937 random(1);
  for (int i = 0; i < 32 * 32; ++i) {
    Texel texel;
    texel.x = i % 32, texel.y = i / 32;
    texel.chart = 0;
    texel.coverage = 1, texel.area = 1;
    map.texel_at[0][i] = i;
    map.texels.push_back(texel);
    // +-0.1 without pattern, and a variance that says so.
    TexelLight light;
    const float noise = random() % 2 == 0 ? 0.1f : -0.1f;
    light.irradiance = Rgb{1, 1, 1} * (1 + noise);
    const float variance = 0.01f / (0.2126f * 0.2126f + 0.7152f * 0.7152f + 0.0722f * 0.0722f);
    light.variance = {variance, variance, variance};
    lights.push_back(light);
  }
  const auto needs = MeasureNeeds(1, map, lights);
  EXPECT_EQ(needs[0].area, 1024);
  // Second differences of the noise are 0.1 * sqrt(1.5); of their square half is left, within 10 % for 1920 of them.
  EXPECT_NEAR(needs[0].rms_gradient, 0.1 * std::sqrt(1.5 / 2), 0.1 * 0.0866);
}

}  // namespace
}  // namespace bakewell
