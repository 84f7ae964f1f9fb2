#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/stability/stress.h"
#include "worker/sample/hash.h"
#include "worker/sample/warp.h"

// Geometry at the ends of what a level may hold, under meters that stand at zero: acne is a ray off an open surface
// that meets something, a leak is light where none can come.
namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kRays = 300000;

Rgb Grey(double x) {
  const float f = static_cast<float>(x);
  return {f, f, f};
}

// Rays over the hemispheres of random points of random triangles that meet something (`meet`) or nothing. Those below
// the horizon of the whole, `up`, are left out: rounding its corners to floats tilts a needle.
int CountRays(const Scene& scene, bool meet, Vec3d up = {}) {
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f);
  EXPECT_TRUE(world.ok());
  const uint32_t triangles = static_cast<uint32_t>((*world)->triangles().size());
  int count = 0;
  for (uint32_t i = 0; i < kRays; ++i) {
    const auto random = [&](uint32_t what) { return UnitFloat(HashCombine(HashCombine(i, 0xac4eu), what)); };
    const Vec2f b = TriangleFromSquare({random(0), random(1)});
    const SurfacePoint point = (*world)->PointAt(i % triangles, b.x, b.y, false);
    const Vec3f dir = FrameFromNormal(point.normal).ToWorld(CosineHemisphere({random(2), random(3)}));
    if (Dot(ToDouble(dir), up) < 0) continue;
    const bool met = static_cast<bool>((*world)->Intersect(RayFrom(point, dir, kInfinity, i)));
    count += met == meet ? 1 : 0;
  }
  return count;
}

// Places along an edge of 8 m: ordinary steps of 1 m, a needle's 8e-6 m between any two.
std::vector<double> NeedleSteps() {
  std::vector<double> at{-4};
  for (int k = 0; k < 8; ++k) {
    at.push_back(-4 + k + 0.5);
    at.push_back(-4 + k + 0.5 + 8e-6);
    at.push_back(-4 + k + 1);
  }
  return at;
}

using Turn = Vec3d (*)(Vec3d);
Vec3d Straight(Vec3d v) { return v; }

// A floor of 8 x 8 m in strips from end to end, most of them as wide as a needle in the chart, though not in the world.
Scene NeedleFloor(Turn turn) {
  SceneBuilder builder({64, 16});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  const std::vector<double> at = NeedleSteps();
  for (size_t k = 0; k + 1 < at.size(); ++k) {
    const PageRect page{static_cast<float>(2 * k), 0, 2, 16};
    builder.AddQuad(turn({at[k], 0, -4}), turn({0, 0, 8}), turn({at[k + 1] - at[k], 0, 0}),
                    {.material = black, .page = {page.x, page.y, page.width, page.height}});
  }
  builder.SetConstantSky({1, 1, 1});
  return builder.Build();
}

TEST(Needles, OfAnOpenFloorHaveNoAcne) {
  EXPECT_EQ(CountRays(NeedleFloor(Straight), true), 0);
  const BakedScene baked = BakeStress(NeedleFloor(Straight), StressSettings(256, 10000));
  // Every ray sees the sky: what is left is the error of 256 Sobol points.
  EXPECT_LT(Compare(baked, [](Vec3d, Vec3d) { return kPi; }).worst, 2e-3);
}

TEST(Needles, OfAnAskewFloorHaveNoAcne) {
  EXPECT_EQ(CountRays(NeedleFloor(Askew), true, Askew({0, 1, 0})), 0);
  const BakedScene baked = BakeStress(NeedleFloor(Askew), StressSettings(256, 10000));
  EXPECT_LT(Compare(baked, [](Vec3d, Vec3d) { return kPi; }).worst, 2e-3);
}

// A closed prism of 8 m: its walls are strips along it that share their corners, its ends are fans.
Scene NeedleBox(Turn turn) {
  std::vector<Vec3d> ring;
  const std::vector<double> at = NeedleSteps();
  for (int side = 0; side < 4; ++side) {
    for (size_t k = 0; k + 1 < at.size(); ++k) {
      const double s = at[k] / 2;
      ring.push_back(side == 0   ? Vec3d{s, -2, 0}
                     : side == 1 ? Vec3d{2, s, 0}
                     : side == 2 ? Vec3d{-s, 2, 0}
                                 : Vec3d{-2, -s, 0});
    }
  }
  SceneBuilder builder({96, 32});
  const int grey = builder.AddMaterial(Grey(0.7));
  const size_t n = ring.size();
  for (size_t k = 0; k < n; ++k) {
    const Vec3d a = ring[k], b = ring[(k + 1) % n], up{0, 0, 8};
    const PageRect page{static_cast<float>(k), 0, 1, 16};
    // Corners are given exactly, so that neighbours share them to the bit.
    builder.AddTriangle(turn(a), turn(b + up), turn(b), {.material = grey, .page = page});
    builder.AddTriangle(turn(a), turn(a + up), turn(b + up), {.material = grey, .lightmapped = false});
    builder.AddTriangle(turn({0, 0, 0}), turn(a), turn(b), {.material = grey, .lightmapped = false});
    builder.AddTriangle(turn({0, 0, 8}), turn(b + up), turn(a + up), {.material = grey, .lightmapped = false});
  }
  builder.SetConstantSky({1000, 1000, 1000});
  builder.AddPointLight(turn({5, 5, 4}), Grey(1e6));
  builder.AddDirectionalLight(turn({-0.5, -0.6, 0.2}), Grey(1e6));
  return builder.Build();
}

void ExpectSealed(Turn turn) {
  const Scene scene = NeedleBox(turn);
  EXPECT_EQ(CountRays(scene, false), 0) << "rays from inside that leave";
  const BakedScene baked = BakeStress(scene, StressSettings(64, 200000));
  EXPECT_EQ(Compare(baked, [](Vec3d, Vec3d) { return 1.0; }).brightest, 0);
}

TEST(Needles, OfASealedBoxLetNoLightIn) { ExpectSealed(Straight); }
TEST(Needles, OfAnAskewSealedBoxLetNoLightIn) { ExpectSealed(Askew); }

TEST(SealedBox, LetsNoLightIn) {
  for (const Turn turn : {Straight, Askew}) {
    SceneBuilder builder({48, 32});
    const int grey = builder.AddMaterial(Grey(0.7));
    const Vec3d x = turn({4, 0, 0}), y = turn({0, 3, 0}), z = turn({0, 0, 5});
    const Vec3d o = turn({0.1, 0.2, 0.3});
    const auto page = [](int k) {
      return PageRect{static_cast<float>(16 * (k % 3)), static_cast<float>(16 * (k / 3)), 15, 15};
    };
    builder.AddQuad(o, z, x, {.material = grey, .page = page(0)});
    builder.AddQuad(o + y, x, z, {.material = grey, .page = page(1)});
    builder.AddQuad(o, x, y, {.material = grey, .page = page(2)});
    builder.AddQuad(o + z, y, x, {.material = grey, .page = page(3)});
    builder.AddQuad(o, y, z, {.material = grey, .page = page(4)});
    builder.AddQuad(o + x, z, y, {.material = grey, .page = page(5)});
    builder.SetConstantSky({1000, 1000, 1000});
    builder.AddPointLight(turn({-0.1, 1, 2}), Grey(1e6));
    const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 200000));
    EXPECT_EQ(Compare(baked, [](Vec3d, Vec3d) { return 1.0; }).brightest, 0);
  }
}

TEST(ThinWalls, AMillimetreApartLetNoLightThrough) {
  // Symptom to be met: light from before a stack of sheets, in the slits or behind it.
  for (const Turn turn : {Straight, Askew}) {
    SceneBuilder builder({64, 32});
    const int grey = builder.AddMaterial(Grey(0.7));
    const Vec3d o = turn({0, 0, 0}), y = turn({0, 4, 0}), z = turn({0, 0, 4});
    constexpr int kSheets = 6;
    std::vector<int> dark;
    for (int k = 0; k < kSheets; ++k) {
      // Facing the lamp at x < 0; the last one closes a box, whose sides run from the first sheet on.
      const PageRect page{static_cast<float>(10 * k), 0, 9, 16};
      const int sheet = builder.AddQuad(o + turn({1e-3 * k, 0, 0}), z, y, {.material = grey, .page = page});
      if (k > 0) dark.push_back(sheet);
    }
    const Vec3d x = turn({3, 0, 0});
    dark.push_back(builder.AddQuad(o, z, x, {.material = grey, .page = {0, 16, 15, 15}}));
    dark.push_back(builder.AddQuad(o + y, x, z, {.material = grey, .page = {16, 16, 15, 15}}));
    dark.push_back(builder.AddQuad(o, x, y, {.material = grey, .page = {32, 16, 15, 15}}));
    dark.push_back(builder.AddQuad(o + z, y, x, {.material = grey, .page = {48, 16, 7, 15}}));
    dark.push_back(builder.AddQuad(o + x, z, y, {.material = grey, .page = {56, 16, 7, 15}}));
    builder.AddPointLight(turn({-1, 2, 2}), Grey(1e4));
    builder.SetConstantSky({10, 10, 10});
    const BakedScene baked = BakeStress(builder.Build(), StressSettings(128, 200000));
    for (const int object : dark) {
      EXPECT_EQ(Compare(
                    baked, [](Vec3d, Vec3d) { return 1.0; }, object)
                    .brightest,
                0)
          << "object " << object;
    }
    EXPECT_GT(Compare(
                  baked, [](Vec3d, Vec3d) { return 1.0; }, 0)
                  .brightest,
              100);
  }
}

TEST(GrazingPlane, OfManyTrianglesHasNoAcne) {
  SceneBuilder builder({32, 32});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  constexpr int kSide = 16;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      builder.AddQuad(Askew({i * 0.37, 0, j * 0.37}), Askew({0, 0, 0.37}), Askew({0.37, 0, 0}),
                      {.material = black, .page = {2.0f * static_cast<float>(i), 2.0f * static_cast<float>(j), 2, 2}});
    }
  }
  constexpr double kElevation = 1e-3;
  const Vec3d dir = Askew({-std::cos(kElevation), -std::sin(kElevation), 0});
  builder.AddDirectionalLight(dir, {1000, 1000, 1000});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(64, 10000));
  // Corners are rounded to 2^-24 of 6 m over 0.37 m: the elevation is known to 0.1 %.
  EXPECT_LT(Compare(baked, [](Vec3d, Vec3d) { return 1000 * std::sin(kElevation); }).worst, 2e-3);
}

TEST(Duplicates, OfAnOpenFloorAreLitAsOne) {
  SceneBuilder builder({32, 16});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  const double scale = 3.3;
  for (int k = 0; k < 2; ++k) {
    builder.AddQuad(Askew({0.1, 0, 0.2}), Askew({0, 0, scale}), Askew({scale, 0, 0}),
                    {.material = black, .page = {16.0f * static_cast<float>(k), 0, 16, 16}});
  }
  builder.SetConstantSky({1, 1, 1});
  const Scene scene = builder.Build();
  EXPECT_EQ(CountRays(scene, true), 0);
  EXPECT_LT(Compare(BakeStress(scene, StressSettings(256, 10000)), [](Vec3d, Vec3d) { return kPi; }).worst, 2e-3);
}

// A glowing furnace, whose floor is there twice.
double FurnaceRatio() {
  SceneBuilder builder({64, 32});
  const int glow = builder.AddMaterial(Grey(0.5), {1, 1, 1});
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.material = glow, .page = {0, 0, 48, 32}});
  builder.AddQuad({0, 0, 0}, {0, 0, 4}, {3, 0, 0}, {.material = glow, .page = {48, 0, 16, 16}});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 200000));
  return Compare(baked, [](Vec3d, Vec3d) { return kPi / 0.5; }).mean_ratio;
}

// Symptom: coincident lamps were sampled apart, and a room with two coincident glowing floors was 14 % too bright.
TEST(Duplicates, GlowOnce) { EXPECT_NEAR(FurnaceRatio(), 1, 0.01); }

// One of several floors at the same place.
struct Floor {
  double glow = 0, alpha = 1;
  AlphaMode mode = AlphaMode::kOpaque;
  bool checkered = false;  // every other texel of its texture has no alpha
  bool faces_down = false, double_sided = false;
};

Texture Checker() {
  constexpr int kSide = 16;
  Texture texture{
      .width = kSide, .height = kSide, .nearest = true, .rgba = std::vector<uint8_t>(4 * kSide * kSide, 255)};
  for (size_t k = 0; k < kSide * kSide; ++k) texture.rgba[4 * k + 3] = (k + k / kSide) % 2 == 0 ? 0 : 255;
  return texture;
}

// Mean light on the walls of a room whose ceiling glows and that has these floors.
double LightOver(const std::vector<Floor>& floors) {
  SceneBuilder builder({64, 32});
  const int texture = builder.AddTexture(Checker());
  const int grey = builder.AddMaterial(Grey(0.5)), glow = builder.AddMaterial(Grey(0.5), {1, 1, 1});
  // Turned, so that coordinates are rounded and planes that meet are not those of the axes.
  const Vec3d o = Askew({0, 0, 0}), x = Askew({3, 0, 0}), y = Askew({0, 2, 0}), z = Askew({0, 0, 4});
  builder.AddQuad(o + y, x, z, {.material = glow, .page = {0, 16, 16, 16}});
  const int first = builder.AddQuad(o, x, y, {.material = grey, .page = {32, 0, 16, 16}});
  builder.AddQuad(o + z, y, x, {.material = grey, .page = {48, 0, 16, 16}});
  builder.AddQuad(o, y, z, {.material = grey, .page = {32, 16, 16, 16}});
  const int last = builder.AddQuad(o + x, z, y, {.material = grey, .page = {48, 16, 16, 16}});
  for (const Floor& floor : floors) {
    Material material;
    material.base_color = Grey(0.5);
    material.base_alpha = static_cast<float>(floor.alpha);
    material.alpha_mode = floor.mode;
    if (floor.checkered) material.base_texture.texture = texture;
    material.emission = Grey(floor.glow);
    material.double_sided = floor.double_sided;
    const int index = builder.AddMaterial(material);
    builder.AddQuad(o, floor.faces_down ? x : z, floor.faces_down ? z : x, {.material = index, .lightmapped = false});
  }
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(128, 100000));
  double sum = 0;
  for (int wall = first; wall <= last; ++wall) {
    sum += Compare(
               baked, [](Vec3d, Vec3d) { return 1.0; }, wall)
               .mean_ratio;
  }
  return sum / (last - first + 1);
}

// Symptom: of coincident floors rays met one and light sampling all: a lamp of 3 beside one of 1 counted for 4 to some.
TEST(Coincident, LampsAreAsBrightAsTheOneThatIsMet) {
  struct Case {
    const char* what;
    std::vector<Floor> there;
    Floor same_as;
  };
  const Floor dark{}, lamp{.glow = 3}, dim{.glow = 1};
  const Floor below{.glow = 3, .faces_down = true}, dark_below{.faces_down = true};
  const Floor both{.glow = 3, .faces_down = true, .double_sided = true};
  const Floor veil{.glow = 5, .alpha = 0.5, .mode = AlphaMode::kBlend};
  const Floor grid{.glow = 5, .mode = AlphaMode::kMask, .checkered = true};
  const Floor dark_grid{.mode = AlphaMode::kMask, .checkered = true};
  const Case cases[] = {{"the same lamp twice", {lamp, lamp}, lamp},
                        {"the brighter of two lamps", {dim, lamp}, lamp},
                        {"a lamp on a floor", {dark, lamp}, lamp},
                        {"a lamp over the back of a floor", {dark_below, lamp}, lamp},
                        {"a floor over the back of a lamp", {dark, below}, dark},
                        {"a lamp under one that faces down", {dim, below}, dim},
                        {"a lamp of two sides on a floor", {dark, both}, lamp},
                        {"a lamp of two sides under a floor", {dark_below, both}, lamp},
                        {"half a veil over a lamp", {dim, veil}, lamp},
                        {"a grid over a lamp", {dim, grid}, lamp},
                        {"a lamp over a grid", {lamp, dark_grid}, lamp},
                        {"a grid of lamps over a floor", {dark, dim, grid}, lamp}};
  for (const Case& c : cases) {
    const double right = LightOver({c.same_as});
    EXPECT_NEAR(LightOver(c.there) / right, 1, 0.01) << c.what;
    EXPECT_NEAR(LightOver({c.there.rbegin(), c.there.rend()}) / right, 1, 0.01) << c.what << ", in the other order";
  }
}

// Light on a black vault that glows, over a floor that lets light pass to the void.
double LightOverVeil(double albedo, const Floor& floor) {
  SceneBuilder builder({32, 16});
  const int texture = builder.AddTexture(Checker());
  const int glow = builder.AddMaterial(Rgb{0, 0, 0}, {1, 1, 1});
  const Vec3d o = Askew({0, 0, 0}), x = Askew({3, 0, 0}), y = Askew({0, 2, 0}), z = Askew({0, 0, 4});
  builder.AddQuad(o + y, x, z, {.material = glow, .page = {0, 0, 16, 16}});
  Material material;
  material.base_color = Grey(albedo);
  material.base_alpha = static_cast<float>(floor.alpha);
  material.alpha_mode = floor.mode;
  if (floor.checkered) material.base_texture.texture = texture;
  builder.AddQuad(o, z, x, {.material = builder.AddMaterial(material), .lightmapped = false});
  return Compare(BakeStress(builder.Build(), StressSettings(512, 500000)), [](Vec3d, Vec3d) { return 1.0; }).mean_ratio;
}

// Symptom: what a veil stops was spread over all of its area and then met by a share of the rays: half a veil reflected
// a quarter, and so did leaves that are half holes.
TEST(Veils, ReflectTheShareThatTheyStop) {
  const double right = LightOverVeil(0.4, {});
  EXPECT_NEAR(LightOverVeil(0.8, {.alpha = 0.5, .mode = AlphaMode::kBlend}) / right, 1, 0.01);
  EXPECT_NEAR(LightOverVeil(0.8, {.mode = AlphaMode::kMask, .checkered = true}) / right, 1, 0.01);
}

TEST(Duplicates, ShareNoPhotons) {
  // Turned, so that coordinates are rounded. Two coincident floors under a glowing vault, against one floor under it.
  double mean[2];
  for (int copies = 1; copies <= 2; ++copies) {
    SceneBuilder builder({64, 32});
    const int glow = builder.AddMaterial(Grey(0.2), {1, 1, 1}), grey = builder.AddMaterial(Grey(0.8));
    const Vec3d x = Askew({3, 0, 0}), y = Askew({0, 2, 0}), z = Askew({0, 0, 4});
    for (int k = 0; k < copies; ++k) {
      builder.AddQuad({0, 0, 0}, z, x, {.material = grey, .page = {16 * static_cast<float>(k), 0, 16, 16}});
    }
    const int ceiling = builder.AddQuad(y, x, z, {.material = glow, .page = {0, 16, 16, 16}});
    builder.AddQuad({0, 0, 0}, x, y, {.material = grey, .page = {32, 0, 16, 16}});
    builder.AddQuad(z, y, x, {.material = grey, .page = {48, 0, 16, 16}});
    builder.AddQuad({0, 0, 0}, y, z, {.material = grey, .page = {32, 16, 16, 16}});
    builder.AddQuad(x, z, y, {.material = grey, .page = {48, 16, 16, 16}});
    const BakedScene baked = BakeStress(builder.Build(), StressSettings(256, 200000));
    mean[copies - 1] = Compare(
                           baked, [](Vec3d, Vec3d) { return 1.0; }, ceiling)
                           .mean_ratio;
  }
  EXPECT_NEAR(mean[1] / mean[0], 1, 0.01);
}

TEST(Coplanar, PatchOnAFloorIsLitAsTheFloor) {
  // A smaller quad in the floor's plane: neither shadows the other.
  SceneBuilder builder({32, 16});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  builder.AddQuad(Askew({0, 0, 0}), Askew({0, 0, 4}), Askew({4, 0, 0}), {.material = black, .page = {0, 0, 16, 16}});
  builder.AddQuad(Askew({1.3, 0, 1.1}), Askew({0, 0, 1.7}), Askew({1.9, 0, 0}),
                  {.material = black, .page = {16, 0, 16, 16}});
  builder.SetConstantSky({1, 1, 1});
  const Scene scene = builder.Build();
  EXPECT_EQ(CountRays(scene, true), 0);
  EXPECT_LT(Compare(BakeStress(scene, StressSettings(256, 10000)), [](Vec3d, Vec3d) { return kPi; }).worst, 2e-3);
}

// An open floor of quads of the given size in texels under a uniform sky.
void ExpectOpenSky(int quads, float texels_per_quad) {
  SceneBuilder builder({32, 32});
  const int black = builder.AddMaterial(Rgb{0, 0, 0});
  for (int j = 0; j < quads; ++j) {
    for (int i = 0; i < quads; ++i) {
      const PageRect page{texels_per_quad * static_cast<float>(i), texels_per_quad * static_cast<float>(j),
                          texels_per_quad, texels_per_quad};
      builder.AddQuad(Askew({i * 0.1, 0, j * 0.1}), Askew({0, 0, 0.1}), Askew({0.1, 0, 0}),
                      {.material = black, .page = page});
    }
  }
  builder.SetConstantSky({1, 1, 1});
  const Deviation d =
      Compare(BakeStress(builder.Build(), StressSettings(256, 10000)), [](Vec3d, Vec3d) { return kPi; });
  EXPECT_LT(d.worst, 2e-3) << texels_per_quad << " texels a quad";
  EXPECT_GT(d.texels, 0);
}

TEST(Texels, OfOneTexelChartsAreRight) { ExpectOpenSky(32, 1); }
TEST(Texels, LargerThanTrianglesAreRight) { ExpectOpenSky(40, 0.05f); }
TEST(Texels, SmallerThanTrianglesAreRight) { ExpectOpenSky(1, 32); }

}  // namespace
}  // namespace bakewell
