#include "worker/light/tree.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "tests/unit/worker/light/lit.h"

namespace bakewell {
namespace {

Scene Lights(int count, uint32_t seed) {
  TestRandom random(seed);
  SceneBuilder builder;
  const int front = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{2, 1, 3});
  Material material;
  material.emission = {1, 1, 1};
  material.double_sided = true;
  const int both = builder.AddMaterial(material);
  builder.AddTriangle({-9, -9, -9}, {-8, -9, -9}, {-9, -8, -9}, {.lightmapped = false});
  for (int i = 0; i < count; ++i) {
    const Vec3d at = ToDouble(random.InCube(5));
    const float size = std::exp2(random.Between(-5, 0));
    if (i % 4 == 0) builder.AddPointLight(at, {random.Unit(), 0, 1});
    if (i % 4 == 1) builder.AddSpotLight(at, ToDouble(random.Direction()), {1, 1, 1}, 0.2, 0.3 + random.Unit());
    if (i % 4 < 2) continue;
    const Vec3d e1 = ToDouble(random.InCube(size)), e2 = ToDouble(random.InCube(size));
    builder.AddTriangle(at, at + e1, at + e2, {.material = i % 4 == 2 ? front : both, .lightmapped = false});
  }
  return builder.Build();
}

LitPlace RandomPlace(TestRandom& random) { return {random.InCube(6), random.Direction()}; }

// Mean unoccluded irradiance (luminance) of a light, over 64 of its points.
double IrradianceOf(const LightSet& lights, int light, Vec3f position, Vec3f normal, TestRandom& random) {
  double sum = 0;
  for (int i = 0; i < 64; ++i) {
    const LightSample sample = lights.SampleLocal(light, position, random.Square());
    sum += static_cast<double>(Luminance(sample.perpendicular) * std::max(0.0f, Dot(sample.dir, normal)));
  }
  return sum / 64;
}

TEST(LightTree, WhatIsCulledBringsNoPointMoreThanIsDispensable) {
  TestRandom random(12);
  size_t culled_lights = 0;
  double largest = 0;
  for (uint32_t scene = 0; scene < 6; ++scene) {
    const Lit lit(Lights(200, 40 + scene));
    const LightTree tree(*lit.lights);
    for (int k = 0; k < 30; ++k) {
      const LitPlace place{random.InCube(12), {}, random.Between(0.01f, 2)};
      const float dispensable = std::exp2(random.Between(-8, 2));
      const std::vector<int> cut = tree.Cut(place, 64), kept = tree.Cull(cut, place, dispensable);
      std::set<int> culled;
      for (const int node : cut) culled.insert(tree.LightsOf(node).begin(), tree.LightsOf(node).end());
      EXPECT_EQ(std::ssize(culled), lit.lights->local_count());
      for (const int node : kept) {
        for (const int light : tree.LightsOf(node)) culled.erase(light);
      }
      culled_lights += culled.size();
      for (int p = 0; p < 4; ++p) {
        const Vec3f position = place.position + random.Direction() * (place.radius * random.Unit());
        const Vec3f normal = random.Direction();
        double sum = 0;
        for (const int light : culled) sum += IrradianceOf(*lit.lights, light, position, normal, random);
        // 64 points of a light tell its irradiance within a few percent; all together they stay below the bound.
        EXPECT_LE(sum, 1.02 * static_cast<double>(dispensable)) << "scene " << scene << " place " << k;
        largest = std::max(largest, sum / static_cast<double>(dispensable));
      }
    }
  }
  EXPECT_GT(culled_lights, 1000u);
  EXPECT_GT(largest, 0.1) << "a bound that loose culls too little";
}

TEST(LightTree, NothingIsCulledWhereNothingIsDispensable) {
  const Lit lit(Lights(100, 3));
  const LightTree tree(*lit.lights);
  const LitPlace place{{1, 2, 3}, {}, 1};
  const std::vector<int> cut = tree.Cut(place, 64);
  EXPECT_EQ(tree.Cull(cut, place, -1), cut);
}

TEST(LightTree, NoLightThatBringsLightIsLeftOut) {
  const Lit lit(Lights(500, 1));
  const LightTree tree(*lit.lights);
  TestRandom random(2);
  int bright = 0;
  for (int i = 0; i < 400; ++i) {
    const LitPlace place = RandomPlace(random);
    for (int light = 0; light < lit.lights->local_count(); ++light) {
      const LightSample sample = lit.lights->SampleLocal(light, place.position, random.Square());
      if (MaxComponent(sample.perpendicular) <= 0 || Dot(sample.dir, place.normal) <= 1e-5f) continue;
      ++bright;
      ASSERT_GT(tree.Probability(LightTree::kRoot, light, place), 0) << light;
    }
  }
  EXPECT_GT(bright, 20000);
}

TEST(LightTree, DrawsWithTheProbabilityThatItSays) {
  // Few enough to be weighed all at once, and so many that halves are chosen first.
  for (int i = 0; i < 6; ++i) {
    const Lit lit(Lights(i % 2 == 0 ? 60 : 900, 3));
    const LightTree tree(*lit.lights);
    TestRandom random(4 + static_cast<uint32_t>(i));
    const LitPlace place = RandomPlace(random);
    constexpr int kDraws = 40000;
    std::vector<double> counts(static_cast<size_t>(lit.lights->local_count()), 0.0);
    for (int k = 0; k < kDraws; ++k) {
      const LightTree::Pick pick = tree.Draw(LightTree::kRoot, place, (static_cast<float>(k) + 0.5f) / kDraws);
      if (pick.light < 0) continue;
      counts[static_cast<size_t>(pick.light)] += 1;
      ASSERT_NEAR(pick.probability, tree.Probability(LightTree::kRoot, pick.light, place), 1e-6f);
    }
    for (int light = 0; light < lit.lights->local_count(); ++light) {
      // Draws in even steps of u: each light's share is off by at most one step at either end.
      const double expected = kDraws * static_cast<double>(tree.Probability(LightTree::kRoot, light, place));
      EXPECT_NEAR(counts[static_cast<size_t>(light)], expected, 2 + 1e-3 * expected);
    }
  }
}

TEST(LightTree, ACutHoldsEveryLightOnce) {
  const Lit lit(Lights(500, 5));
  const LightTree tree(*lit.lights);
  for (const size_t most : {1, 7, 64, 256, 10000}) {
    const std::vector<int> cut = tree.Cut({{1, 2, 3}, {}, 0.5f}, most);
    EXPECT_LE(cut.size(), most);
    std::multiset<int> lights;
    for (const int node : cut) {
      for (const int light : tree.LightsOf(node)) lights.insert(light);
    }
    EXPECT_EQ(lights.size(), static_cast<size_t>(lit.lights->local_count()));
    EXPECT_EQ(std::set<int>(lights.begin(), lights.end()).size(), lights.size());
  }
}

// The variance of one shadowless sample, over the square of the mean, by the tree and by flux alone.
TEST(LightTree, IsQuieterThanAChoiceByFlux) {
  const Lit lit(Lights(2000, 6));
  const LightTree tree(*lit.lights);
  double total = 0;
  for (int light = 0; light < lit.lights->local_count(); ++light)
    total += static_cast<double>(lit.lights->Power(light));
  TestRandom random(7);
  double by_tree = 0, by_flux = 0;
  for (int i = 0; i < 50; ++i) {
    const LitPlace place = RandomPlace(random);
    double mean = 0, square_tree = 0, square_flux = 0;
    for (int light = 0; light < lit.lights->local_count(); ++light) {
      const LightSample sample = lit.lights->SampleLocal(light, place.position, {0.3f, 0.6f});
      const double cosine = std::max(0.0, static_cast<double>(Dot(sample.dir, place.normal)));
      const double e = static_cast<double>(Luminance(sample.perpendicular)) * cosine;
      if (!(e > 0)) continue;
      mean += e;
      square_tree += e * e / static_cast<double>(tree.Probability(LightTree::kRoot, light, place));
      square_flux += e * e * total / static_cast<double>(lit.lights->Power(light));
    }
    by_tree += square_tree / (mean * mean) / 50;
    by_flux += square_flux / (mean * mean) / 50;
  }
  // Of a perfect choice 1. Halves all the way down: 16.3; by flux 73.
  EXPECT_LT(by_tree, 3) << by_tree << " against " << by_flux;
}

}  // namespace
}  // namespace bakewell
