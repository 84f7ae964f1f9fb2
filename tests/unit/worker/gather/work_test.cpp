#include "worker/gather/work.h"

#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// The two numbers that stand for eight groups' differences: their squares are the variance on average, and what all
// groups have alike is none.
TEST(TexelWork, PhotonNoiseSquaredIsThePhotonsVarianceOnAverage) {
  SceneBuilder builder({4, 4});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {.page = {0, 0, 4, 4}});
  const PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  TexelWork work(TexelSampler(*prepared.world, prepared.layout, prepared.texels, prepared.texels.texels.front()));
  for (int i = 0; i < 4; ++i) work.indirect.Count();
  TestRandom random(3);
  std::array<double, 2> square{};
  double variance = 0;
  constexpr int kTurns = 10000;
  for (int turn = 0; turn < kTurns; ++turn) {
    for (float& group : work.group) group = 100 + random.Between(-1, 1);
    variance += static_cast<double>(work.PhotonVariance());
    const std::array<float, 2> noise = work.PhotonNoise();
    for (size_t k = 0; k < 2; ++k) square[k] += static_cast<double>(noise[k] * noise[k]);
  }
  for (const double of_one : square) EXPECT_NEAR(of_one / variance, 1, 0.05);
  work.group.fill(7);
  EXPECT_EQ(work.PhotonNoise(), (std::array<float, 2>{0, 0}));
}

}  // namespace
}  // namespace bakewell
