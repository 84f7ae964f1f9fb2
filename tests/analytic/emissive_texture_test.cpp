#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

// Light from the bright texels of emissive textures against the same light from geometry, in bakes that stop by
// themselves.
namespace bakewell {
namespace {

constexpr int kTexels = 64;

enum class Light : uint8_t { kNearest, kFiltered, kCutOut, kGeometry };  // kCutOut: a lamp with holes
using IsLit = std::function<bool(int x, int y)>;                         // texels, x right, y up

// A facade of 4 x 4 m over a pavement of 4 x 4 m, with a wall to the left, all grey; some of its texels are lit.
Scene Street(const IsLit& is_lit, Light light) {
  SceneBuilder builder({64, 32});
  const double texel = 4.0 / kTexels;
  Texture texture{.width = kTexels, .height = kTexels, .nearest = light != Light::kFiltered, .rgba = {}};
  int lit = 0;
  for (int y = 0; y < kTexels; ++y) {
    for (int x = 0; x < kTexels; ++x) lit += is_lit(x, y) ? 1 : 0;
  }
  const float radiance = 1e5f / static_cast<float>(lit);
  const int lamp = builder.AddMaterial({0, 0, 0}, {radiance, radiance, 0.5f * radiance});
  for (int y = 0; y < kTexels; ++y) {
    for (int x = 0; x < kTexels; ++x) {
      texture.rgba.insert(texture.rgba.end(), 4, is_lit(x, y) ? 255 : 0);
      if (!is_lit(x, y) || light != Light::kGeometry) continue;
      builder.AddQuad({x * texel, y * texel, 1e-3}, {texel, 0, 0}, {0, texel, 0},
                      {.material = lamp, .lightmapped = false});
    }
  }
  Material facade, sign;
  facade.base_color = {0.5f, 0.5f, 0.5f};
  sign.base_color = {0, 0, 0};
  sign.alpha_mode = AlphaMode::kMask;
  if (light != Light::kGeometry) {
    (light == Light::kCutOut ? sign : facade).emission = {radiance, radiance, 0.5f * radiance};
    (light == Light::kCutOut ? sign.base_texture : facade.emission_texture).texture = builder.AddTexture(texture);
  }
  if (light == Light::kCutOut) {
    builder.AddQuad({0, 0, 1e-3}, {4, 0, 0}, {0, 4, 0}, {.material = builder.AddMaterial(sign), .lightmapped = false});
  }
  builder.AddQuad({0, 0, 0}, {4, 0, 0}, {0, 4, 0},
                  {.material = builder.AddMaterial(facade), .page = {0, 0, 16, 16}, .name = "facade"});
  builder.AddQuad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, {.page = {16, 0, 32, 32}, .name = "pavement"});
  builder.AddQuad({0, 0, 0}, {0, 4, 0}, {0, 0, 4}, {.page = {48, 0, 16, 16}, .name = "wall"});
  return builder.Build();
}

struct Baked {
  double mean = 0;  // irradiance of the pavement [W m^-2], green
  std::vector<double> texels;
};

Baked PavementOf(const Scene& scene, uint32_t seed, float target = 0) {
  BakeSettings settings;  // medium
  settings.seed = seed;
  settings.target_error = target;
  const BakedScene result = BakeSceneInMemory(scene, settings);
  Baked baked;
  const World& world = *result.prepared.world;
  for (size_t i = 0; i < result.texels().size(); ++i) {
    const uint32_t triangle = result.prepared.texels.fragments[result.texels()[i].fragment_begin].triangle;
    if (world.scene().objects[world.triangles()[triangle].object].name != "pavement") continue;
    baked.texels.push_back(static_cast<double>(result.lights()[i].irradiance.y));
    baked.mean += baked.texels.back();
  }
  baked.mean /= static_cast<double>(baked.texels.size());
  return baked;
}

double RelativeRms(const Baked& a, const Baked& b) {
  double squares = 0;
  for (size_t i = 0; i < a.texels.size(); ++i) squares += std::pow(a.texels[i] / b.texels[i] - 1, 2);
  return std::sqrt(squares / static_cast<double>(a.texels.size()));
}

void ExpectAsGeometry(const IsLit& is_lit) {
  const Baked right = PavementOf(Street(is_lit, Light::kGeometry), 100, 0.005f);
  for (const Light light : {Light::kNearest, Light::kFiltered, Light::kCutOut}) {
    for (uint32_t seed = 0; seed < 3; ++seed) {
      const Baked baked = PavementOf(Street(is_lit, light), seed);
      EXPECT_NEAR(baked.mean / right.mean, 1, 0.02) << static_cast<int>(light);
      EXPECT_LT(RelativeRms(baked, right), 0.08) << static_cast<int>(light);
    }
  }
}

// Symptom: a seventh of the light, in a bake at medium.
TEST(EmissiveTexture, OneLitTexelLightsAStreetAsAWindowDoes) {
  ExpectAsGeometry([](int x, int y) { return x == 37 && y == 25; });
}

TEST(EmissiveTexture, ALitWindowOfFourByFourTexelsDoes) {
  ExpectAsGeometry([](int x, int y) { return x / 4 == 9 && y / 4 == 6; });
}

TEST(EmissiveTexture, ANeonSignLightsAStreetAsItsTubesDo) {
  // A ring and a bar of one texel's width.
  ExpectAsGeometry([](int x, int y) {
    const double r = std::hypot(x - 20.0, y - 40.0);
    return (r >= 9.5 && r < 10.5) || (y == 30 && x >= 36 && x < 60);
  });
}

}  // namespace
}  // namespace bakewell
