#include "worker/gather/direct.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// A floor of one tile below lamps of all kinds, some of them behind a wall.
Scene Hall(int lights) {
  TestRandom random(7);
  SceneBuilder builder({16, 16});
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{2, 1, 3});
  builder.AddQuad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, {.page = {0, 0, 16, 16}});
  builder.AddBox({2, 0, -6}, {2.1, 6, 6}, {.lightmapped = false});
  for (int i = 0; i < lights; ++i) {
    const Vec3d at = ToDouble(random.InCube(4)) + Vec3d{1, 4.5, 0};
    if (i % 3 == 0) builder.AddPointLight(at, {random.Unit(), 0, 1});
    if (i % 3 == 1) builder.AddSpotLight(at, {0.1, -1, 0}, {1, 1, 1}, 0.3, 1);
    if (i % 3 == 2) builder.AddTriangle(at, at + Vec3d{0.2, 0, 0}, at + Vec3d{0, 0, 0.2}, {lamp, false});
  }
  return builder.Build();
}

class TileLightsTest : public testing::TestWithParam<std::tuple<int, float>> {
 protected:
  // Lights drawn in even steps of u come as often as they say, and emissive ones as often as the density that weighs
  // them against rays says.
  void Check(const std::function<LightTree::Pick(float)>& draw, const std::function<float(int)>& probability) {
    constexpr int kDraws = 20000;
    const auto count = static_cast<size_t>(lights_.local_count());
    std::vector<double> drawn(count, 0), said(count, 0);
    for (int k = 0; k < kDraws; ++k) {
      const LightTree::Pick pick = draw((static_cast<float>(k) + 0.5f) / kDraws);
      if (pick.light < 0) continue;
      drawn[static_cast<size_t>(pick.light)] += 1;
      said[static_cast<size_t>(pick.light)] = static_cast<double>(pick.probability);
    }
    int emissive = 0, punctual = 0;
    for (size_t light = 0; light < count; ++light) {
      EXPECT_NEAR(drawn[light], kDraws * said[light], 3 + 2e-3 * drawn[light]) << light;
      if (!lights_.IsEmissive(static_cast<int>(light))) {
        punctual += drawn[light] > 0 ? 1 : 0;
        continue;
      }
      const double weighed = kDraws * static_cast<double>(probability(static_cast<int>(light)));
      EXPECT_NEAR(drawn[light], weighed, 3 + 2e-3 * drawn[light]) << light;
      emissive += weighed > 0 ? 1 : 0;
    }
    EXPECT_GT(emissive, 3);
    EXPECT_GT(punctual, 3);
  }

  const Scene scene_ = Hall(std::get<0>(GetParam()));
  const PreparedLevel prepared_ = PrepareInMemory(scene_, {});
  const LightSet& lights_ = *prepared_.lights;
  const LightTree tree_{lights_};
  const SurfaceCells cells_{};
  const RadianceCache cache_{};
  const GatherScene gather_{*prepared_.world, lights_, tree_, cells_, cache_};
  GatherCounters counters_;
  const TileLights tile_{
      gather_, prepared_.texels,        0,        static_cast<uint32_t>(prepared_.texels.texels.size()),
      5,       std::get<1>(GetParam()), counters_};
};

TEST_P(TileLightsTest, DrawsForATexelWithTheProbabilityThatItSays) {
  for (const size_t i : {size_t{3}, size_t{100}, size_t{250}}) {
    const Texel& texel = prepared_.texels.texels[i];
    const TileLights::Choice choice = tile_.ForTexel(texel, 0.1f);
    SurfacePoint point = prepared_.world->PointAt(0, 0.3f, 0.3f, false);
    point.position = texel.position;
    Check([&](float u) { return tile_.Draw(choice, point, u); },
          [&](int light) { return tile_.Probability(choice, point, light); });
  }
}

TEST_P(TileLightsTest, DrawsNearTheTileWithTheProbabilityThatItSays) {
  TestRandom random(8);
  SurfacePoint point = prepared_.world->PointAt(0, 0.3f, 0.3f, false);
  const Vec3f floor = point.position;
  for (int k = 0; k < 3; ++k) {
    point.position = floor + random.InCube(1);
    point.normal = NormalizeOrZero(random.Direction() + Vec3f{0, 1, 0});
    Check([&](float u) { return tile_.DrawNear(point, u); },
          [&](int light) { return tile_.ProbabilityNear(point, light); });
  }
}

// Few lights, and more than a cut has nodes; all of them, and without the weakest.
INSTANTIATE_TEST_SUITE_P(Lights, TileLightsTest,
                         testing::Combine(testing::Values(60, 900), testing::Values(-1.0f, 0.05f)));

}  // namespace
}  // namespace bakewell
