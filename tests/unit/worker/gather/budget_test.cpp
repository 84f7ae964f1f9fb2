#include "worker/gather/budget.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

constexpr int kShadeRows = 4;

GatherOptions Options() {
  GatherOptions options;
  options.target_error = 0.05f;
  options.mean_irradiance = 3;
  return options;
}

// How many of a tile's texels go on after eight samples whose mean is signal(x, y) and whose deviation is
// deviation(x, y). The tile's last rows are a chart of their own.
int GoOn(
    const std::function<float(int, int)>& signal, const GatherOptions& options = Options(),
    const std::function<float(int, int)>& deviation = [](int, int) { return 1.0f; }) {
  SceneBuilder builder({kTileSide, kTileSide});
  constexpr int kFirst = kTileSide - kShadeRows;
  builder.AddQuad({0, 0, 0}, {16, 0, 0}, {0, 0, -kFirst}, {.page = {0, 0, kTileSide, kFirst}});
  builder.AddQuad({0, 5, 0}, {16, 0, 0}, {0, 0, -kShadeRows}, {.page = {0, kFirst, kTileSide, kShadeRows}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  const TexelMap& map = prepared.texels;
  TileBudget budget(map, 0, options);
  const auto count = static_cast<uint32_t>(map.texels.size());
  SmoothTile tile(map, 0, count);
  int64_t rays = 0;
  tile.Connect(*prepared.world, std::vector<bool>(count, true), std::vector<bool>(count, false), rays);
  budget.WillBeFiltered(std::move(tile));
  TestRandom random(3);
  std::vector<TexelWork> work;
  for (const Texel& texel : map.texels) {
    TexelWork& one = work.emplace_back(TexelSampler(*prepared.world, prepared.layout, map, texel));
    constexpr uint32_t kSamples = 8;
    for (uint32_t i = 0; i < kSamples; ++i) {
      float normal = -6;
      for (int k = 0; k < 12; ++k) normal += random.Unit();
      one.indirect.Count();
      one.indirect.AddIrradiance(i, kSamples,
                                 Rgb{1, 1, 1} * (signal(texel.x, texel.y) + deviation(texel.x, texel.y) * normal));
    }
    one.has_direct = false;
    one.choice.empty = true;
    one.direct_samples = one.indirect_samples = kSamples;
    one.indirect_active = true;
  }
  budget.Decide(work);
  int active = 0;
  for (const TexelWork& one : work) active += one.indirect_active ? 1 : 0;
  return active;
}

// Stripes that noise half hides are blurred, however little noise that leaves: more samples bring them out.
TEST(TileBudget, GoesOnWhereTheFilterBlurs) {
  const int flat = GoOn([](int, int) { return 3.0f; });
  const int striped = GoOn([](int x, int) { return x % 4 < 2 ? 2.6f : 3.4f; });
  EXPECT_LT(flat, 64);
  EXPECT_GT(striped, 2 * flat + 32);
}

// Symptom: where most light fell on few texels, within the shade of a lamp, these took the error that the dim texels
// around them did not need: 20 % came where 8 % were asked for.
TEST(TileBudget, FewBrightTexelsDoNotTakeTheErrorThatDimOnesLeave) {
  GatherOptions options = Options();
  options.filter = false;
  const auto in_shade = [](int y) { return y >= kTileSide - kShadeRows; };
  const auto light = [&](int, int y) { return in_shade(y) ? 150.0f : 0.6f; };
  const auto deviation = [&](int, int y) { return in_shade(y) ? 4.5f : 0.0f; };
  // Each is off by less than a texel of its light may be, 2 x 0.05 sqrt(3 x 150), but all together by more than the
  // tile.
  const int shade = GoOn(light, options, deviation);
  EXPECT_GT(shade, 40);
  EXPECT_LE(shade, kShadeRows * kTileSide);
  options.worst_samples = 8;  // so that only the tile's sum can ask for more
  EXPECT_EQ(GoOn(light, options, deviation), shade);
  options.mean_samples = 0;  // the tile has had more
  EXPECT_EQ(GoOn(light, options, deviation), 0);
}

// Symptom: beside a window's patch on a floor, calm texels went on at any number of samples, lest they had missed it.
TEST(TilePool, WhatIsRareCountsForLessTheMoreSamplesMissedIt) {
  SceneBuilder builder({kTileSide, kTileSide});
  builder.AddQuad({0, 0, 0}, {16, 0, 0}, {0, 0, -16}, {.page = {0, 0, kTileSide, kTileSide}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  const TexelMap& map = prepared.texels;
  const TilePool pool(map, 0, std::vector<bool>(map.texels.size(), true));
  constexpr float kCalm = 1e-6f, kNoisy = 4;  // variance of one sample
  const auto of_calm = [&](int samples) {
    std::vector<float> variance;
    size_t calm = 0;
    for (const Texel& texel : map.texels) {
      if (texel.x == 2 && texel.y == 8) calm = variance.size();
      variance.push_back((texel.x < 12 ? kCalm : kNoisy) / static_cast<float>(samples));
    }
    const std::vector<float> pooled = pool.Variance(variance, std::vector<int>(variance.size(), samples));
    return pooled[calm] * static_cast<float>(samples);
  };
  // A quarter of the chart is noisy.
  EXPECT_NEAR(of_calm(4), 0.1f * kNoisy / 4, 1e-3f);
  EXPECT_NEAR(of_calm(64), kNoisy / 4 * 4 / (4 + 9 * 64), 1e-4f);
}

}  // namespace
}  // namespace bakewell
