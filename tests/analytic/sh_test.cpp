#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

SceneBuilder BlackFloor() {
  SceneBuilder builder({8, 8});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0},
                  {.material = black, .lightmapped = true, .page = {0, 0, 8, 8}, .name = "floor"});
  return builder;
}

BakeSettings Samples(int count) {
  BakeSettings settings;
  settings.min_samples = settings.max_samples = count;
  settings.photons = 1000;
  return settings;
}

TEST(SphericalHarmonics, DeltaLightGivesItsIrradianceTimesTheBasis) {
  SceneBuilder builder = BlackFloor();
  builder.AddDirectionalLight({0.3, -0.9, 0.2}, {2, 3, 4});
  const BakedScene result = BakeSceneInMemory(builder.Build(), Samples(16));
  const auto basis = EvaluateSh(NormalizeOrZero(Vec3f{-0.3f, 0.9f, -0.2f}));
  for (const TexelLight& light : result.lights()) {
    for (size_t i = 0; i < kShCoefficients; ++i) EXPECT_NEAR(light.sh.lambda[i].y, 3 * basis[i], 2e-6) << i;
  }
}

TEST(SphericalHarmonics, UniformSkyGivesTheHemispheresMoments) {
  SceneBuilder builder = BlackFloor();
  builder.SetConstantSky({2, 2, 2});
  const BakedScene result = BakeSceneInMemory(builder.Build(), Samples(4096));
  // Integrals of Y_i over the hemisphere about +y: Y0 2 pi c0, Y1 pi c1, and of band 2 the parts that survive the
  // azimuth: Y6 = c6 (3 z^2 - 1), Y8 = c8 (x^2 - y^2), z^2 and x^2 integrate to 2 pi/3, y^2 to 2 pi/3: both vanish.
  const double expected[kShCoefficients] = {2 * 2 * kPi * 0.28209479, 2 * kPi * 0.48860251, 0, 0, 0, 0, 0, 0, 0};
  for (const TexelLight& light : result.lights()) {
    for (size_t i = 0; i < kShCoefficients; ++i)
      EXPECT_NEAR(light.sh.lambda[i].x, expected[i], 0.01) << i;  // 0.3 % of lambda_0
  }
}

TEST(SphericalHarmonics, ReconstructedIrradianceOfAUniformSkyIsNearTheGatheredOne) {
  SceneBuilder builder = BlackFloor();
  builder.SetConstantSky({2, 2, 2});
  const BakedScene result = BakeSceneInMemory(builder.Build(), Samples(1024));
  for (const TexelLight& light : result.lights()) {
    // A_0 lambda_0 Y_0 + A_1 lambda_1 Y_1 = pi L (1/2 + 1/2): the hemisphere's l = 2 vanishes.
    EXPECT_NEAR(IrradianceFromSh(light.sh, {0, 1, 0}).x, light.irradiance.x, 0.02);
  }
}

}  // namespace
}  // namespace bakewell
