#include "worker/light/lights.h"

#include <gtest/gtest.h>

#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "tests/unit/worker/light/lit.h"

namespace bakewell {
namespace {

Vec3d Wide(Vec3f v) { return ToDouble(v); }

// Emissive triangles of many sizes, one- and two-sided, points and spots of all widths about the origin.
Scene ManyLights(uint32_t seed) {
  TestRandom random(seed);
  SceneBuilder builder;
  const int front = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{2, 1, 3});
  Material material;
  material.emission = {1, 1, 1};
  material.double_sided = true;
  const int both = builder.AddMaterial(material);
  for (int i = 0; i < 60; ++i) {
    const float size = std::exp2(random.Between(-4, 2));
    const Vec3f at = random.InCube(3);
    builder.AddTriangle(Wide(at), Wide(at + random.InCube(size)), Wide(at + random.InCube(size)),
                        {.material = i % 2 == 0 ? front : both, .lightmapped = false});
  }
  for (int i = 0; i < 20; ++i) {
    builder.AddPointLight(Wide(random.InCube(3)), {0, 0, 1});
    const double outer = 0.02 + 1.55 * static_cast<double>(random.Unit());
    const double inner = outer * static_cast<double>(random.Unit());
    builder.AddSpotLight(Wide(random.InCube(3)), Wide(random.Direction()), {1, 1, 1}, inner, outer);
  }
  return builder.Build();
}

TEST(LightSet, SampleLocalsPdfIsPdfLocal) {
  const Lit lit(ManyLights(1));
  TestRandom random(2);
  int checked = 0;
  for (int light = 0; light < lit.lights->local_count(); ++light) {
    if (!lit.lights->IsEmissive(light)) continue;
    for (int i = 0; i < 200; ++i) {
      const Vec3f from = random.InCube(4);
      const LightSample sample = lit.lights->SampleLocal(light, from, random.Square());
      if (MaxComponent(sample.perpendicular) <= 0) continue;
      const Triangle& t = lit.world->triangles()[sample.target_triangle];
      const float pdf =
          lit.lights->PdfLocal(light, from, sample.dir, HitAt(t, sample.target_triangle, from, sample.target));
      // The direction is good to about 1e-6; what that is of the cosine to the light grows where it grazes.
      if (pdf > 1e4f) continue;
      EXPECT_NEAR(sample.pdf / pdf, 1, 2e-3) << "light " << light;
      ++checked;
    }
  }
  EXPECT_GT(checked, 5000);
}

TEST(LightSet, PdfOfATriangleIntegratesToItsVisibleShareOfOne) {
  // Mean of 1/pdf over samples is the solid angle, near or far, in front of a triangle.
  SceneBuilder builder;
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{1, 1, 1});
  builder.AddTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {.material = lamp, .lightmapped = false});
  const Lit lit(builder.Build());
  TestRandom random(3);
  for (const float distance : {0.1f, 1.0f, 3.0f, 20.0f}) {
    const Vec3f from = Vec3f{0.4f, 0.2f, distance} - ToFloat(lit.scene.origin_ws);
    double sum = 0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) sum += 1 / static_cast<double>(lit.lights->SampleLocal(0, from, random.Square()).pdf);
    const Triangle& t = lit.world->triangles()[0];
    const Vec3d a = NormalizeOrZero(Wide(t.p0 - from)), b = NormalizeOrZero(Wide(t.p0 + t.e1 - from)),
                c = NormalizeOrZero(Wide(t.p0 + t.e2 - from));
    const double solid_angle = 2 * std::atan2(std::fabs(Dot(a, Cross(b, c))), 1 + Dot(a, b) + Dot(b, c) + Dot(c, a));
    EXPECT_NEAR(sum / n / solid_angle, 1, 5e-3) << distance;  // by area, 1/pdf varies by a few per cent over it
  }
}

// A point of the disc (normal given) or ball (normal zero) of `radius` about `position`; every fourth on its rim.
Vec3f Within(TestRandom& random, Vec3f position, Vec3f normal, float radius) {
  Vec3f d = random.Direction();
  if (Dot(normal, normal) > 0) d = NormalizeOrZero(d - normal * Dot(d, normal));
  const float share = random.Unit();
  return position + d * (radius * (share < 0.25f ? 0.9999f : share));
}

// True where some sample of the light lights a point within the radius.
bool Reaches(const Lit& lit, TestRandom& random, int light, Vec3f position, Vec3f normal, float radius) {
  for (int k = 0; k < 8; ++k) {
    const Vec3f at = Within(random, position, normal, radius);
    const LightSample sample = lit.lights->SampleLocal(light, at, random.Square());
    const bool faces = Dot(normal, normal) == 0 || Dot(sample.dir, normal) > 0;
    if (MaxComponent(sample.perpendicular) > 0 && faces) return true;
  }
  return false;
}

float WeightOf(const LightSet& lights, int light, const LitPlace& place) {
  const LightShape shape = lights.ShapeOf(light);
  LightPack::Weights weights;
  LightPack(std::span(&shape, 1)).Weigh(place, 0, 1, weights);
  return weights.total;
}

TEST(LightSet, ShapesHaveAWeightWhereverTheirLightReaches) {
  int reached = 0, missed = 0;
  for (uint32_t seed = 10; seed < 20; ++seed) {
    const Lit lit(ManyLights(seed));
    TestRandom random(seed);
    for (int i = 0; i < 20000; ++i) {
      const int light = std::min(lit.lights->local_count() - 1,
                                 static_cast<int>(random.Unit() * static_cast<float>(lit.lights->local_count())));
      const Vec3f position = random.InCube(3);
      const float radius = std::exp2(random.Between(-8, 0));
      const Vec3f normal = i % 4 == 0 ? Vec3f{} : random.Direction();
      if (!Reaches(lit, random, light, position, normal, radius)) continue;
      ++reached;
      if (WeightOf(*lit.lights, light, {position, normal, radius}) > 0) continue;
      if (++missed <= 3) {
        ADD_FAILURE() << "light " << light << (lit.lights->IsEmissive(light) ? " (triangle)" : " (punctual)")
                      << " seed " << seed << " case " << i << " radius " << radius;
      }
    }
  }
  EXPECT_GT(reached, 50000);
  EXPECT_EQ(missed, 0) << "of " << reached;
}

TEST(LightSet, ShapeOfASpotCountsTheRimOfTheRegion) {
  // A light was never chosen for a texel whose nearer half its cone lit: the cone was widened by atan(r/d), not asin.
  SceneBuilder builder;
  builder.AddQuad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {.lightmapped = false});
  builder.AddSpotLight({0.5, 1, 0.5}, {0, -1, 0}, {1, 1, 1}, 0.1, 0.58);
  const Lit lit(builder.Build());
  // 60 degrees off the axis, 1 m away, radius 0.5 m: points at 30 degrees (0.52 rad) are in it, those of 36.9 are not.
  const Vec3f light = lit.lights->locals()[0].position, to{std::sin(kPiF / 3), -0.5f, 0};
  EXPECT_GT(WeightOf(*lit.lights, 0, {light + to, {}, 0.5f}), 0);
  EXPECT_EQ(WeightOf(*lit.lights, 0, {light + to, {}, 0.45f}), 0);
}

TEST(LightSet, ShapeOfAGrazingLightHasAWeight) {
  SceneBuilder builder;
  builder.AddQuad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {.lightmapped = false});
  builder.AddPointLight({50, 0.001, 0.5}, {1, 1, 1});
  const Lit lit(builder.Build());
  const Vec3f position = Vec3f{0.5f, 0, 0.5f} - ToFloat(lit.scene.origin_ws);
  EXPECT_GT(WeightOf(*lit.lights, 0, {position, {0, 1, 0}, 0.1f}), 0);
  EXPECT_EQ(WeightOf(*lit.lights, 0, {position, {0, -1, 0}, 1e-5f}), 0);
}

TEST(LightSet, PowerIsTheIntegralOfIntensity) {
  SceneBuilder builder;
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{2, 2, 2});
  builder.AddQuad({0, 0, 0}, {3, 0, 0}, {0, 1, 0}, {.material = lamp, .lightmapped = false});
  builder.AddPointLight({0, 1, 0}, {1, 1, 1});
  builder.AddSpotLight({0, 1, 0}, {0, -1, 0}, {1, 1, 1}, 0.3, 0.9);
  const Lit lit(builder.Build());
  ASSERT_EQ(lit.lights->local_count(), 4);
  EXPECT_NEAR(lit.lights->Power(0), 4 * kPi, 1e-4);
  const PunctualLight& spot = lit.lights->locals()[1];
  double power = 0;
  for (int i = 0; i < 100000; ++i) {
    const double z = (i + 0.5) / 100000;
    power += static_cast<double>(SpotFalloff(spot, static_cast<float>(z))) * 2 * kPi / 100000;
  }
  EXPECT_NEAR(lit.lights->Power(1) / power, 1, 1e-3);
  EXPECT_NEAR(lit.lights->Power(2) + lit.lights->Power(3), 2 * kPi * 3, 1e-4);
}

}  // namespace
}  // namespace bakewell
