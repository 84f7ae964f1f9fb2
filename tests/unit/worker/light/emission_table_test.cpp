#include "worker/light/emission_table.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "tests/unit/worker/light/lit.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr int kTexels = 64;

Texture Dark(int side, bool nearest) {
  const auto bytes = static_cast<size_t>(4 * side * side);
  return {.width = side, .height = side, .nearest = nearest, .rgba = std::vector<uint8_t>(bytes, 0)};
}

uint8_t* TexelOf(Texture& texture, int x, int y) {
  return texture.rgba.data() + 4 * static_cast<ptrdiff_t>(y * texture.width + x);
}

// A facade of 2 x 2 m in the plane z = 0 that looks along +z, one square of whose texels is lit.
struct LitSquare {
  int x, y, texels;
};
Scene FacadeWith(Texture texture, LitSquare lit) {
  for (int y = lit.y; y < lit.y + lit.texels; ++y) {
    for (int x = lit.x; x < lit.x + lit.texels; ++x) std::fill_n(TexelOf(texture, x, y), 3, uint8_t{255});
  }
  SceneBuilder builder;
  Material material;
  material.emission = {1000, 1000, 1000};
  material.emission_texture.texture = builder.AddTexture(texture);
  builder.AddQuad({0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {.material = builder.AddMaterial(material), .lightmapped = false});
  return builder.Build();
}

constexpr int kLitX = 13, kLitY = 21;
Scene Facade(int lit_texels, bool nearest) { return FacadeWith(Dark(kTexels, nearest), {kLitX, kLitY, lit_texels}); }

// Over pi [W m^-2 sr^-1 m^2].
float FluxOf(const Scene& scene) {
  const Lit lit(scene);
  float flux = 0;
  for (const EmissiveTriangle& light : lit.lights->emissive()) flux += light.area * light.mean_radiance.x;
  return flux;
}

// The same light from geometry.
Scene Window(int lit_texels) {
  const double texel = 2.0 / kTexels, side = texel * lit_texels;
  SceneBuilder builder;
  const int lamp = builder.AddMaterial(Rgb{0, 0, 0}, Rgb{1000, 1000, 1000});
  builder.AddQuad({kLitX * texel, kLitY * texel, 0}, {side, 0, 0}, {0, side, 0},
                  {.material = lamp, .lightmapped = false});
  return builder.Build();
}

struct Estimate {
  double mean = 0, variance = 0;  // variance: of one sample
};

template <typename Sample>
Estimate MeanOf(int n, Sample sample) {
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double x = sample();
    sum += x;
    squares += x * x;
  }
  return {sum / n, squares / n - sum / n * (sum / n)};
}

// Irradiance at a point of the world on a plane that faces the facade: one sample of each of its triangles.
Estimate Irradiance(const Lit& lit, Vec3d at_ws, uint32_t seed, int n) {
  const Vec3f at = ToFloat(at_ws - lit.scene.origin_ws);
  TestRandom random(seed);
  return MeanOf(n, [&] {
    double sum = 0;
    for (int light = 0; light < lit.lights->local_count(); ++light) {
      const LightSample sample = lit.lights->SampleLocal(light, at, random.Square());
      sum += static_cast<double>(sample.perpendicular.x * std::max(0.0f, -sample.dir.z));
    }
    return sum;
  });
}

// The same by points that are even over the triangles' area.
Estimate EvenIrradiance(const Lit& lit, Vec3d at_ws, uint32_t seed, int n) {
  const Vec3f at = ToFloat(at_ws - lit.scene.origin_ws);
  TestRandom random(seed);
  return MeanOf(n, [&] {
    double sum = 0;
    for (const EmissiveTriangle& light : lit.lights->emissive()) {
      const Vec2f b = TriangleFromSquare(random.Square());
      const Vec3f to = lit.world->PointAt(light.triangle, b.x, b.y, false).position - at;
      const float distance2 = Dot(to, to);
      sum += static_cast<double>(lit.world->GlowAt(light.triangle, b.x, b.y, false).x * light.area * to.z * to.z /
                                 (distance2 * distance2));
    }
    return sum;
  });
}

// Symptom: the one lit window of a facade fell between the 64 points that said how bright its triangles are, and all
// its light was lost.
TEST(EmissionTable, OneLitWindowOfAFacadeIsALight) {
  EXPECT_NEAR(FluxOf(Facade(2, false)), 1000 * 4 * 4.0f / (kTexels * kTexels), 1);
}

// Symptom: of the points on a facade one of 4,096 fell into its one lit texel, and a bake stopped before it saw light.
TEST(EmissionTable, OneLitTexelGivesWhatTheSameGeometryGives) {
  constexpr int n = 100000;
  const double x = (kLitX + 0.5) * 2 / kTexels, y = (kLitY + 0.5) * 2 / kTexels;
  const Lit window(Window(1));
  for (const bool nearest : {true, false}) {
    const Lit lit(Facade(1, nearest));
    for (const Vec3d at : {Vec3d{x, y, 0.3}, Vec3d{x + 0.3, y, 0.2}, Vec3d{1.9, 0.1, 1}, Vec3d{x, y, 30}}) {
      const Estimate right = Irradiance(window, at, 1, n), got = Irradiance(lit, at, 2, n),
                     even = EvenIrradiance(lit, at, 3, n);
      // The tent of a filtered texel is twice as wide as the texel, which is a sixth to a tenth of the least distances.
      const double blur = nearest ? 0 : 0.01 * right.mean;
      EXPECT_NEAR(got.mean, right.mean, 4 * std::sqrt((right.variance + got.variance) / n) + blur)
          << nearest << " " << at.z;
      EXPECT_LT(4 * std::sqrt(got.variance / n), 0.02 * got.mean);
      EXPECT_GT(even.variance, 1000 * got.variance) << nearest << " " << at.z;
    }
  }
}

// Triangles of many sizes about the origin with textures of 1 to 40 texels a side, most of them dark, on one or both
// sides, through alpha, filtered or not, repeated, turned and scaled.
Scene Textured(uint32_t seed) {
  TestRandom random(seed);
  SceneBuilder builder;
  for (int i = 0; i < 60; ++i) {
    Texture texture = Dark(1 + static_cast<int>(40 * random.Unit()), random.Unit() < 0.5f);
    texture.wrap_u = static_cast<WrapMode>(i % 3);
    texture.wrap_v = static_cast<WrapMode>(i / 3 % 3);
    for (uint8_t& value : texture.rgba) {
      if (random.Unit() < 0.1f) value = static_cast<uint8_t>(256 * random.Unit());
    }
    *TexelOf(texture, 0, 0) = 255;
    Material material;
    material.emission = {random.Unit(), 1, 2};
    material.double_sided = i % 2 == 0;
    material.alpha_mode = static_cast<AlphaMode>(i % 5 % 3);
    material.alpha_cutoff = random.Unit();
    TextureRef ref{.texture = builder.AddTexture(texture),
                   .offset = {random.Unit(), random.Unit()},
                   .scale = {random.Between(-2, 2), random.Between(-2, 2)},
                   .rotation_rad = random.Between(-3, 3)};
    if (i % 4 != 0) material.emission_texture = ref;
    if (i % 4 != 1) material.base_texture = ref;
    const float size = std::exp2(random.Between(-4, 2));
    const Vec3f at = random.InCube(3);
    builder.AddTriangle(ToDouble(at), ToDouble(at + random.InCube(size)), ToDouble(at + random.InCube(size)),
                        {.material = builder.AddMaterial(material), .lightmapped = false});
  }
  return builder.Build();
}

TEST(EmissionTable, SampleLocalsPdfIsPdfLocal) {
  const Lit lit(Textured(1));
  TestRandom random(2);
  int near = 0, far = 0, back = 0, apart = 0;
  for (int light = 0; light < lit.lights->local_count(); ++light) {
    const EmissiveTriangle& emissive = lit.lights->emissive()[static_cast<size_t>(light)];
    if (lit.lights->TableOf(emissive) == nullptr) continue;
    const Triangle& t = lit.world->triangles()[emissive.triangle];
    for (int i = 0; i < 400; ++i) {
      const Vec3f from = i % 2 == 0 ? random.InCube(4) : t.p0 + random.Direction() * random.Between(0.1f, 2);
      const LightSample sample = lit.lights->SampleLocal(light, from, random.Square());
      if (MaxComponent(sample.perpendicular) <= 0) continue;
      const Hit hit = HitAt(t, emissive.triangle, from, sample.target);
      const float pdf = lit.lights->PdfLocal(light, from, sample.dir, hit);
      if (pdf > 1e4f) continue;  // as for triangles that glow evenly
      const bool is_near = emissive.area > 0.05f * hit.t * hit.t;
      ++(is_near ? near : far);
      back += hit.back ? 1 : 0;
      apart += std::fabs(sample.pdf / pdf - 1) > 2e-3f ? 1 : 0;
    }
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 1000);
  EXPECT_GT(back, 500);
  EXPECT_LE(apart, (near + far) / 1000);  // points within rounding of a cell's edge
}

TEST(EmissionTable, PdfLocalIntegratesToOne) {
  const Lit lit(Textured(3));
  TestRandom random(4);
  int checked = 0;
  for (int light = 0; light < lit.lights->local_count(); ++light) {
    const EmissiveTriangle& emissive = lit.lights->emissive()[static_cast<size_t>(light)];
    if (lit.lights->TableOf(emissive) == nullptr) continue;
    const Triangle& t = lit.world->triangles()[emissive.triangle];
    const float size = std::sqrt(emissive.area);
    const Vec3f from = t.p0 + (t.e1 + t.e2) * (1.0f / 3) + t.normal * (size * (light % 2 == 0 ? 0.8f : 20.0f));
    const int side = 2 * EmissionTable::SideFor(*lit.world, emissive.triangle);  // four points a cell
    double sum = 0;
    for (int k = 0; k < side * side; ++k) {
      const float step = 1.0f / static_cast<float>(side);
      const Vec2f b = TriangleFromSquare(
          {(static_cast<float>(k % side) + 0.5f) * step, (static_cast<float>(k / side) + 0.5f) * step});
      const Vec3f to = t.p0 + t.e1 * b.x + t.e2 * b.y - from;
      const float distance = Length(to), cosine = std::fabs(Dot(to, t.normal)) / distance;
      const Hit hit{.triangle = emissive.triangle, .t = distance, .u = b.x, .v = b.y};
      sum += static_cast<double>(lit.lights->PdfLocal(light, from, to / distance, hit) * cosine * emissive.area /
                                 (distance * distance)) /
             (static_cast<double>(side) * side);
    }
    EXPECT_NEAR(sum, 1, 5e-3) << light;  // the cosine within a cell
    ++checked;
  }
  EXPECT_GT(checked, 30);
}

TEST(EmissionTable, HoldsEveryPointThatGlows) {
  int lit_points = 0;
  for (uint32_t seed = 10; seed < 20; ++seed) {
    const Lit lit(Textured(seed));
    TestRandom random(seed);
    for (const EmissiveTriangle& light : lit.lights->emissive()) {
      const EmissionTable* table = lit.lights->TableOf(light);
      if (table == nullptr) continue;
      for (int i = 0; i < 1000; ++i) {
        const Vec2f b = TriangleFromSquare(random.Square());
        const float glow = MaxComponent(lit.world->GlowAt(light.triangle, b.x, b.y, i % 2 == 0));
        if (glow <= 0) continue;
        ++lit_points;
        ASSERT_GT(table->Pdf(b), 0);
        ASSERT_LE(glow, table->Pdf(b) * table->most_over_pdf() * 1.0001f);
      }
    }
  }
  EXPECT_GT(lit_points, 50000);
}

// The scale of the photons' fixed point goes by it.
TEST(EmissionTable, BoundOfOneLitTexelIsNearItsMean) {
  const Lit lit(Facade(1, false));
  int tables = 0;
  for (const EmissiveTriangle& light : lit.lights->emissive()) {
    const EmissionTable* table = lit.lights->TableOf(light);
    if (table == nullptr) continue;
    ++tables;
    EXPECT_LT(table->most_over_pdf(), 40 * table->mean().x);  // evenly it would be 8,192
  }
  EXPECT_EQ(tables, 1);  // the texel is in the lower of the two triangles
}

TEST(EmissionTable, MeanIsThatOfThePointsDrawn) {
  const Lit lit(Textured(5));
  TestRandom random(6);
  for (const EmissiveTriangle& light : lit.lights->emissive()) {
    const EmissionTable* table = lit.lights->TableOf(light);
    if (table == nullptr) continue;
    EXPECT_EQ(light.mean_radiance.y, table->mean().y);
    const Estimate drawn = MeanOf(20000, [&] {
      const EmissionTable::Sample sample = table->Draw(random.Square());
      const Vec2f b = sample.barycentrics;
      Rgb glow = lit.world->GlowAt(light.triangle, b.x, b.y, false);
      if (light.two_sided) glow = (glow + lit.world->GlowAt(light.triangle, b.x, b.y, true)) / 2.0f;
      return static_cast<double>(Luminance(glow) / sample.pdf);
    });
    // The table's mean is that of a pattern of points: within a tenth where a few texels are cut by many edges.
    EXPECT_NEAR(drawn.mean / static_cast<double>(Luminance(table->mean())), 1, 0.1);
  }
}

TEST(EmissionTable, ATriangleThatGlowsAboutEvenlyHasNone) {
  for (const int dark : {60, 220}) {  // linear 0.05 and 0.72
    Texture texture = Dark(8, false);
    for (size_t i = 0; i < texture.rgba.size(); ++i)
      texture.rgba[i] = static_cast<uint8_t>(i / 4 % 2 == 0 ? 255 : dark);
    SceneBuilder builder;
    Material material;
    material.emission = {1, 1, 1};
    material.emission_texture.texture = builder.AddTexture(texture);
    builder.AddTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {.material = builder.AddMaterial(material)});
    const Lit lit(builder.Build());
    EXPECT_EQ(lit.lights->TableOf(lit.lights->emissive()[0]) == nullptr, dark == 220);
  }
}

// Symptom: of a texture of 4,096 x 4,096 what was smaller than 12 x 12 texels fell between the points, and its triangle
// was no light.
TEST(EmissionTable, LargeTexturesLoseNothingBetweenThePoints) {
  const auto flux_of = [](int lit) { return FluxOf(FacadeWith(Dark(4096, true), {1365, 819, lit})); };
  const float of_texel = 1000 * 4.0f / (4096 * 4096);
  EXPECT_NEAR(flux_of(8) / (64 * of_texel), 1, 0.05);
  EXPECT_NEAR(flux_of(3) / (9 * of_texel), 1, 0.5);
  EXPECT_GT(flux_of(1), 0);
}

// The windows of a tower, `count` quads with the same texture coordinates, and one with others.
Scene Tower(int count) {
  Texture texture = Dark(64, false);
  for (int x = 10; x < 14; ++x) std::fill_n(TexelOf(texture, x, 30), 3, uint8_t{255});
  SceneBuilder builder;
  Material material;
  material.emission = {100, 100, 100};
  material.emission_texture.texture = builder.AddTexture(texture);
  material.double_sided = true;
  const int lamp = builder.AddMaterial(material);
  for (int i = 0; i < count; ++i) {
    builder.AddQuad({0, 0, 3.0 * i}, {2, 0, 0}, {0, 2, 0}, {.material = lamp, .lightmapped = false});
  }
  material.emission_texture.scale = {2, 2};
  builder.AddQuad({0, 0, -3}, {2, 0, 0}, {0, 2, 0}, {.material = builder.AddMaterial(material), .lightmapped = false});
  return builder.Build();
}

// Symptom: a thousand lamps took 2.5 s, and 37,000 had no tables.
TEST(EmissionPatterns, LampsThatGlowAlikeShareATable) {
  const Lit lit(Tower(20000));
  std::set<const EmissionTable*> tables, of_tower;
  for (const EmissiveTriangle& light : lit.lights->emissive()) {
    tables.insert(lit.lights->TableOf(light));
    if (lit.world->triangles()[light.triangle].object < 20000) of_tower.insert(lit.lights->TableOf(light));
  }
  EXPECT_EQ(lit.lights->local_count(), 20000 + 2);  // of each quad of the tower one triangle is dark
  EXPECT_EQ(tables.count(nullptr), 0);
  EXPECT_EQ(of_tower.size(), 1);
  EXPECT_EQ(tables.size(), 3);
}

TEST(EmissionPatterns, TrianglesThatCoincideAreTheirOwn) {
  Scene scene = Tower(3);
  scene.objects[1].position = scene.objects[0].position;  // both sides of each glow: the second is never met
  const Lit lit(std::move(scene));
  std::set<uint32_t> objects;
  for (const EmissiveTriangle& light : lit.lights->emissive()) {
    objects.insert(lit.world->triangles()[light.triangle].object);
  }
  EXPECT_EQ(objects, (std::set<uint32_t>{0, 2, 3}));
}

TEST(EmissionPatterns, TheSameForAnyNumberOfThreads) {
  const auto all = [](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Lit lit(Textured(7));
    std::vector<float> numbers;
    for (const EmissiveTriangle& light : lit.lights->emissive()) {
      numbers.insert(numbers.end(), {static_cast<float>(light.table), light.mean_radiance.x, light.mean_radiance.z});
      if (const EmissionTable* table = lit.lights->TableOf(light)) {
        numbers.push_back(table->most_over_pdf());
        numbers.push_back(table->Pdf({0.25f, 0.5f}));
      }
    }
    return numbers;
  };
  EXPECT_EQ(all(1), all(8));
}

TEST(EmissionTable, VeryManyHaveLess) {
  std::vector<int> sides(100, 256);
  EXPECT_EQ(EmissionTable::LargestSide(sides, size_t{64} << 20), 256);
  sides.resize(1000, 256);
  EXPECT_EQ(EmissionTable::LargestSide(sides, size_t{64} << 20), 64);
  sides.resize(1000000, 8);
  EXPECT_EQ(EmissionTable::LargestSide(sides, size_t{64} << 20), 0);
  EXPECT_EQ(EmissionTable::LargestSide({}, 0), 256);
}

}  // namespace
}  // namespace bakewell
