#include "worker/light/pack.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// Points, spots and emitters of all sizes about the origin.
std::vector<LightShape> Shapes(int count, TestRandom& random) {
  std::vector<LightShape> shapes;
  for (int i = 0; i < count; ++i) {
    LightShape shape{.center = random.InCube(4), .cone_rad = kPiF, .intensity = random.Between(0.1f, 5)};
    if (i % 3 > 0) {
      shape.axis = random.Direction();
      shape.cone_rad = random.Between(0.1f, 2);
    }
    if (i % 3 == 2) shape.radius = std::exp2(random.Between(-6, 1));
    shape.two_sided = i % 6 == 5;
    shapes.push_back(shape);
  }
  return shapes;
}

bool Reaches(const LightShape& shape, Vec3f from, Vec3f point, Vec3f normal) {
  const Vec3f dir = NormalizeOrZero(from - point);
  const float cosine = -Dot(dir, shape.axis);
  const bool in_cone = std::max(cosine, shape.two_sided ? -cosine : cosine) > std::cos(shape.cone_rad);
  return in_cone && (Dot(normal, normal) < 0.5f || Dot(normal, dir) > 0);
}

TEST(LightPack, WhateverReachesSomePointOfAPlaceHasAWeight) {
  TestRandom random(1);
  const std::vector<LightShape> shapes = Shapes(250, random);
  const LightPack pack(shapes);
  int reached = 0, not_weighed = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3f normal = k % 3 == 0 ? Vec3f{} : random.Direction();
    const LitPlace place{random.InCube(5), normal, k % 2 == 0 ? 0 : std::exp2(random.Between(-6, 1))};
    LightPack::Weights weights;
    pack.Weigh(place, 0, shapes.size(), weights);
    for (size_t i = 0; i < shapes.size(); ++i) {
      if (!(weights.of[i] > 0)) ++not_weighed;
      for (int p = 0; p < 8; ++p) {
        Vec3f across = random.Direction();
        across = NormalizeOrZero(across - normal * Dot(across, normal));
        const Vec3f point = place.position + across * (place.radius * random.Unit());
        const Vec3f from = shapes[i].center + random.Direction() * (shapes[i].radius * random.Unit());
        if (!Reaches(shapes[i], from, point, normal)) continue;
        ++reached;
        ASSERT_GT(weights.of[i], 0) << "shape " << i << ", place " << k;
      }
    }
  }
  EXPECT_GT(reached, 100000);
  EXPECT_GT(not_weighed, 20000) << "what weighs everything leaves nothing out";
}

TEST(LightPack, WeighsByIntensityCosineAndDistance) {
  const LightShape lamp{.center = {0, 0, 3}, .cone_rad = kPiF, .intensity = 18};
  LightShape spot{.center = {0, 0, 2}, .axis = {0, 0, -1}, .cone_rad = 1.0f, .intensity = 8};
  spot.scale = 4;
  spot.offset = -3.5f;
  spot.least = 0.01f;
  spot.squared = true;
  const std::vector<LightShape> shapes{lamp, spot};
  LightPack::Weights weights;
  LightPack(shapes).Weigh({{4, 0, 0}, {0, 0, 1}}, 0, 2, weights);
  EXPECT_NEAR(weights.of[0], 18.0f / 25 * 0.6f, 1e-6f);
  EXPECT_EQ(weights.of[1], 0) << "outside its cone";
  LightPack(shapes).Weigh({{0, 0, 0}, {0, 0.6f, 0.8f}}, 0, 2, weights);
  EXPECT_NEAR(weights.of[0], 18.0f / 9 * 0.8f, 1e-6f);
  EXPECT_NEAR(weights.of[1], 8.0f / 4 * 0.8f * 0.25f, 1e-6f) << "half of it at its axis, squared";
  EXPECT_NEAR(weights.total, weights.of[0] + weights.of[1], 1e-6f);
}

TEST(LightPack, DrawsFromARangeAsItWeighsIt) {
  TestRandom random(2);
  const std::vector<LightShape> shapes = Shapes(100, random);
  const LightPack pack(shapes);
  for (const auto& [begin, end] : {std::pair<size_t, size_t>{0, 100}, {3, 4}, {17, 28}, {92, 100}}) {
    LightPack::Weights weights;
    pack.Weigh({random.InCube(5), {}, 0}, begin, end, weights);
    constexpr int kDraws = 100000;
    std::vector<int> counts(end - begin, 0);
    for (int k = 0; k < kDraws; ++k) {
      const DrawnWeight drawn = DrawWeight(weights, end - begin, (static_cast<float>(k) + 0.5f) / kDraws);
      ASSERT_GE(drawn.index, 0);
      ASSERT_GT(drawn.probability, 0);
      ASSERT_GE(drawn.remainder, 0);
      ASSERT_LT(drawn.remainder, 1);
      ++counts[static_cast<size_t>(drawn.index)];
    }
    for (size_t i = 0; i < counts.size(); ++i) {
      EXPECT_NEAR(counts[i], kDraws * weights.of[i] / weights.total, 3) << begin + i;
    }
  }
}

TEST(LightPack, NothingIsDrawnWhereNothingReaches) {
  const std::vector<LightShape> shapes(3, {.center = {0, 0, 1}, .axis = {0, 0, 1}, .cone_rad = 0.5f, .intensity = 1});
  LightPack::Weights weights;
  LightPack(shapes).Weigh({{0, 0, 0}, {0, 0, 1}}, 0, 3, weights);
  EXPECT_EQ(weights.total, 0);
  EXPECT_EQ(DrawWeight(weights, 3, 0.5f).index, -1);
}

}  // namespace
}  // namespace bakewell
