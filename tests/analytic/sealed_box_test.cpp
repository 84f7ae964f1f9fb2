#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

// A lit room and a sealed dark one, side by side on one floor quad under one ceiling quad, a wall of `thickness`
// between them, the whole turned by `angle` about y so that no grid lines up with the wall.
Scene TwoRooms(double thickness, double angle) {
  SceneBuilder builder({64, 64});
  const int grey = builder.AddMaterial(Rgb{0.7f, 0.7f, 0.7f});
  const double c = std::cos(angle), s = std::sin(angle);
  const auto turn = [&](Vec3d p) { return Vec3d{c * p.x + s * p.z, p.y, -s * p.x + c * p.z}; };
  const auto quad = [&](Vec3d origin, Vec3d u, Vec3d v, PageRect page) {
    builder.AddQuad(turn(origin), turn(u), turn(v), {.material = grey, .lightmapped = page.width > 0, .page = page});
  };
  quad({-4, 0, -2}, {0, 0, 4}, {8, 0, 0}, {0, 0, 32, 64});   // floor, up
  quad({-4, 3, -2}, {8, 0, 0}, {0, 0, 4}, {32, 0, 32, 32});  // ceiling, down
  quad({-4, 0, -2}, {8, 0, 0}, {0, 3, 0}, {});               // sides
  quad({-4, 0, 2}, {0, 3, 0}, {8, 0, 0}, {});
  quad({-4, 0, -2}, {0, 3, 0}, {0, 0, 4}, {});
  quad({4, 0, -2}, {0, 0, 4}, {0, 3, 0}, {});
  quad({0, 0, -2}, {0, 0, 4}, {0, 3, 0}, {});  // the wall's two faces
  quad({thickness, 0, -2}, {0, 3, 0}, {0, 0, 4}, {});
  builder.AddPointLight(turn({-2, 2, 0}), {10, 10, 10});
  return builder.Build();
}

void ExpectDark(double thickness, double angle) {
  BakeSettings settings;
  settings.min_samples = settings.max_samples = 256;
  settings.photons = 300000;
  const BakedScene result = BakeSceneInMemory(TwoRooms(thickness, angle), settings);
  double lit = 0, lit_count = 0, dark = 0, dark_count = 0;
  const double c = std::cos(angle), s = std::sin(angle);
  const double half_texel = 8.0 / 64;
  for (size_t i = 0; i < result.texels().size(); ++i) {
    const Vec3d p = ToDouble(result.texels()[i].position) + result.prepared.level->scene.origin_ws;
    const double x = c * p.x - s * p.z;  // along the rooms
    const double value = static_cast<double>(Luminance(result.lights()[i].irradiance));
    if (x < -half_texel) lit += value, lit_count += 1;
    if (x > thickness + half_texel) dark += value, dark_count += 1;
  }
  ASSERT_GT(dark_count, 500);
  EXPECT_GT(lit / lit_count, 1);
  EXPECT_LT(dark / dark_count, 1e-4 * (lit / lit_count)) << "wall " << thickness << " m, turned by " << angle;
}

TEST(SealedBox, StaysDarkBehindAWallOfFiveCentimetres) { ExpectDark(0.05, 0); }
TEST(SealedBox, StaysDarkBehindAWallOfAMillimetre) { ExpectDark(0.001, 0); }
TEST(SealedBox, StaysDarkTurned) { ExpectDark(0.02, 0.5); }

}  // namespace
}  // namespace bakewell
