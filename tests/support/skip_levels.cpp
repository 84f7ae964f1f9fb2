#include "tests/support/skip_levels.h"

#include <cmath>

#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

constexpr Vec3d kUp{0, 1, 0};

// Cell (column, row) of a page cut into `cells` x `cells`, a texel inside it.
PageRect Cell(int page, int cells, int column, int row) {
  const float side = static_cast<float>(page) / static_cast<float>(cells);
  return {static_cast<float>(column) * side + 1, static_cast<float>(row) * side + 1, side - 2, side - 2};
}

// A sky that is dark but for a bright patch.
Environment PatchySky() {
  Environment sky;
  sky.type = EnvironmentType::kLatLong;
  sky.width = 32;
  sky.height = 16;
  sky.latlong.assign(32 * 16, {0.2f, 0.25f, 0.3f});
  sky.latlong[4 * 32 + 5] = {40, 38, 30};
  return sky;
}

Texture BarkAndLeaves() {
  Texture texture;
  texture.width = texture.height = 64;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool hole = x >= 32 && ((x / 4 + y / 4) % 2 == 0);
      for (const int value : {120, 160, 90, hole ? 0 : 255}) texture.rgba.push_back(static_cast<uint8_t>(value));
    }
  }
  return texture;
}

}  // namespace

Scene RoomsLevel(int page, int lit) {
  SceneBuilder builder({page, page});
  const int glow = builder.AddMaterial({0.5f, 0.5f, 0.5f}, {6, 6, 5});
  for (int i = 0; i < 10; ++i) {
    const double x = 6.0 * i;
    builder.AddRoom({x, 0, 0}, {x + 5, 3, 5}, {.page = Cell(page, 4, i % 4, i / 4)});
    builder.AddBox({x + 1, 0.01, 1}, {x + 2, 1, 2}, {.page = Cell(page, 8, i % 8, 6 + i / 8)});
    if (i >= lit) continue;
    builder.AddPointLight({x + 3.5, 2, 3.5}, {8, 8, 8});
    builder.AddQuad({x + 2, 2.99, 2}, {1, 0, 0}, {0, 0, 1}, {.material = glow, .lightmapped = false});
  }
  return builder.Build();
}

Scene BunkerLevel(int page) {
  SceneBuilder builder({page, page});
  const float side = static_cast<float>(page);
  builder.AddRoom({0, 0, 0}, {12, 3, 8}, {.page = {1, 1, side - 2, 0.75f * side - 2}});
  builder.AddBox({-0.2, -0.2, -0.2}, {12.2, 3.2, 8.2},
                 {.page = {1, 0.75f * side + 1, 0.5f * side - 2, 0.25f * side - 2}});
  builder.AddQuad({-20, -0.3, 20}, {52, 0, 0}, {0, 0, -40},
                  {.page = {0.5f * side + 1, 0.75f * side + 1, 0.5f * side - 2, 0.25f * side - 2}});
  for (int i = 0; i < 6; ++i) builder.AddPointLight({1 + 2.0 * i, 2.2, 2 + (i % 2) * 4.0}, {2, 2, 1.5f});
  builder.AddDirectionalLight({0.4, -1, 0.3}, {3, 3, 3}, 0.0093);
  builder.SetEnvironment(PatchySky());
  return builder.Build();
}

Scene PlaneLevel(int page) {
  SceneBuilder builder({page, page});
  const float side = static_cast<float>(page);
  builder.AddQuad({0, 0, 0}, {40, 0, 0}, {0, 0, -40}, {.page = {0, 0, side, side}});
  builder.SetConstantSky({1, 1, 1});
  return builder.Build();
}

Scene FoliageLevel(int page) {
  SceneBuilder builder({page, page});
  const float side = static_cast<float>(page);
  Material material;
  material.alpha_mode = AlphaMode::kMask;
  material.base_texture.texture = builder.AddTexture(BarkAndLeaves());
  material.double_sided = true;
  const int leaves = builder.AddMaterial(material);
  material.base_texture.scale = {0.35f, 1};  // the opaque part
  material.base_texture.offset = {0.06f, 0};
  const int bark = builder.AddMaterial(material);
  material.base_texture.scale = {0.45f, 1};
  material.base_texture.offset = {0.52f, 0};
  builder.AddQuad({0, 0, 0}, {40, 0, 0}, {0, 0, -40}, {.page = {0, 0, side, side}});
  for (int i = 0; i < 100; ++i) {
    const double x = 2 + 4.0 * (i % 10), z = -2 - 4.0 * (i / 10);
    builder.AddBox({x - 0.3, 0.01, z - 0.3}, {x + 0.3, 3, z + 0.3}, {.material = bark, .lightmapped = false});
    for (int k = 0; k < 8; ++k) {
      const double turn = kPi * k / 8;
      const Vec3d along{3 * std::cos(turn), 0, 3 * std::sin(turn)};
      builder.AddQuad(Vec3d{x, 2, z} - along * 0.5, along, kUp * 2.5, {.material = leaves, .lightmapped = false});
    }
  }
  builder.AddDirectionalLight({0.4, -1, 0.3}, {3, 3, 3}, 0.0093);
  builder.SetConstantSky({0.5f, 0.6f, 0.8f});
  return builder.Build();
}

Scene SlitLevel(int page, double gap_m) {
  SceneBuilder builder({page, page});
  const float side = static_cast<float>(page);
  const int grey = builder.AddMaterial({0.5f, 0.5f, 0.5f});
  builder.AddRoom({0, 0, 0}, {20, 3, 10}, {.page = {1, 1, side - 2, side - 2}});
  // The wall at x = 10, in two parts that leave the slit.
  const double from = 4.9, to = from + gap_m;
  builder.AddBox({10, -0.1, -0.1}, {10.1, 3.1, from}, {.material = grey, .lightmapped = false});
  builder.AddBox({10, -0.1, to}, {10.1, 3.1, 10.1}, {.material = grey, .lightmapped = false});
  builder.AddPointLight({4, 2, 5.02}, {40, 40, 40});
  return builder.Build();
}

Scene SpotsLevel(int page) {
  SceneBuilder builder({page, page});
  const float side = static_cast<float>(page);
  builder.AddQuad({0, 0, 0}, {60, 0, 0}, {0, 0, -60}, {.page = {0, 0, side, side}});
  for (int i = 0; i < 1024; ++i) {
    const double x = 1 + 1.875 * (i % 32), z = -1 - 1.875 * (i / 32);
    builder.AddSpotLight({x, 3, z}, {0, -1, 0}, {3, 3, 2.5f}, 0.5, 0.8);
  }
  return builder.Build();
}

}  // namespace bakewell
