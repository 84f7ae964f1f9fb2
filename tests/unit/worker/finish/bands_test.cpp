#include "worker/finish/bands.h"

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr float kTarget = 0.04f;

// Two charts of 32 texels under light from above, the second with another light from the side, both with noise in
// l = 2.
struct Page {
  TexelMap map;
  std::vector<TexelLight> lights;

  explicit Page(float noise) {
    TestRandom random(3);
    map.pages = {{8, 8}};
    for (int i = 0; i < 64; ++i) {
      Texel texel;
      texel.x = i % 8;
      texel.y = i / 8;
      texel.chart = i / 32;
      map.texels.push_back(texel);
      TexelLight light;
      light.irradiance = {3, 3, 3};
      light.sh.lambda[0] = {1.77f, 1.77f, 1.77f};
      light.sh.lambda[1] = {1.53f, 1.53f, 1.53f};
      for (size_t k = 4; k < 9; ++k) light.sh.lambda[k] = Rgb{1, 0.5f, 0.2f} * (noise * random.Between(-1, 1));
      if (texel.chart == 1) light.sh.lambda[8] += Rgb{1, 1, 1};
      lights.push_back(light);
    }
  }
  SkipCount Drop() {
    SkipCount count;
    DropBands(map, 0, kTarget, lights, count);
    return count;
  }
};

float IrradianceAt(const RadianceSh& sh, Vec3f normal) {
  constexpr std::array<float, 3> kCosine = {kPiF, 2 * kPiF / 3, kPiF / 4};
  const auto basis = EvaluateSh(normal);
  float sum = 0;
  for (size_t i = 0; i < 9; ++i) sum += kCosine[i == 0 ? 0 : i < 4 ? 1 : 2] * Luminance(sh.lambda[i]) * basis[i];
  return sum;
}

TEST(DropBands, NoiseBelowTheTargetGoesAndLightStays) {
  Page page(0.05f);
  const std::vector<TexelLight> before = page.lights;
  const SkipCount count = page.Drop();
  EXPECT_EQ(count.of, 4);
  EXPECT_EQ(count.skipped, 1);
  EXPECT_EQ(count.saved, 5 * 32);
  TestRandom random(4);
  double square = 0;
  for (size_t i = 0; i < 32; ++i) {
    EXPECT_EQ(page.lights[i].irradiance, before[i].irradiance);
    EXPECT_EQ(page.lights[i].sh.lambda[1], before[i].sh.lambda[1]);
    for (size_t k = 4; k < 9; ++k) EXPECT_EQ(page.lights[i].sh.lambda[k], Rgb{});
    float worst = 0;
    for (int n = 0; n < 200; ++n) {
      const Vec3f normal = random.Direction();
      worst = std::max(worst, std::fabs(IrradianceAt(page.lights[i].sh, normal) - IrradianceAt(before[i].sh, normal)));
    }
    square += static_cast<double>(worst) * static_cast<double>(worst) / 32;
  }
  EXPECT_LT(std::sqrt(square), 3 * kTarget) << "over every texel's worst normal";
  EXPECT_GT(square, 0);
  for (size_t i = 32; i < 64; ++i) EXPECT_EQ(page.lights[i].sh.lambda[8], before[i].sh.lambda[8]);
}

// A dim chart is judged by itself: beside a bright one it keeps what shapes its light.
TEST(DropBands, DimChartsKeepTheirShape) {
  Page page(0.05f);
  for (size_t i = 32; i < 64; ++i) {
    page.lights[i].irradiance = page.lights[i].irradiance * 1e-4f;
    for (Rgb& lambda : page.lights[i].sh.lambda) lambda = lambda * 1e-4f;
  }
  EXPECT_EQ(page.Drop().skipped, 1);
  EXPECT_GT(page.lights[40].sh.lambda[8].x, 0);
}

TEST(DropBands, WhatIsAboveTheTargetStays) {
  Page page(0.5f);
  const std::vector<TexelLight> before = page.lights;
  EXPECT_EQ(page.Drop().skipped, 0);
  for (size_t i = 0; i < 64; ++i) EXPECT_EQ(page.lights[i].sh.lambda[5], before[i].sh.lambda[5]);
}

}  // namespace
}  // namespace bakewell
