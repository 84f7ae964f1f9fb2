#include "worker/gather/budget.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// How many of a tile's texels go on after eight samples whose mean is signal(x, y) and whose deviation is 1, where the
// noise of the filtered light would do.
int GoOn(const std::function<float(int, int)>& signal) {
  SceneBuilder builder({kTileSide, kTileSide});
  builder.AddQuad({0, 0, 0}, {16, 0, 0}, {0, 0, -16}, {.page = {0, 0, kTileSide, kTileSide}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  const TexelMap& map = prepared.texels;
  GatherOptions options;
  options.target_error = 0.05f;
  options.mean_irradiance = 3;
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
      one.indirect.AddIrradiance(i, kSamples, Rgb{1, 1, 1} * (signal(texel.x, texel.y) + normal));
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

}  // namespace
}  // namespace bakewell
