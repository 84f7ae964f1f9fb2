#include "worker/trace/world.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <thread>

#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "worker/trace/texture.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A unit square in the plane z = 0 about the origin, front towards +z.
Scene Square(Material material) {
  SceneBuilder builder;
  const int index = builder.AddMaterial(std::move(material));
  builder.AddQuad({-0.5, -0.5, 0}, {1, 0, 0}, {0, 1, 0}, {.material = index, .lightmapped = false});
  return builder.Build();
}

std::unique_ptr<World> Build(const Scene& scene, BackfaceMode mode = BackfaceMode::kReflect) {
  return World::Build(scene, mode, 0.98f).value();
}

Ray Down(float x, float y, uint32_t key = 0) { return {{x, y, 1}, {0, 0, -1}, kInfinity, key}; }
Ray Up(float x, float y) { return {{x, y, -1}, {0, 0, 1}, kInfinity, 0}; }

// Symptom: bakes used one thread for each of two tasks, however many cores there were: Embree, told to use one thread,
// had told all of TBB.
TEST(World, LeavesTbbItsThreads) {
  const auto world = Build(Square({}));
  const tbb::global_control two(tbb::global_control::max_allowed_parallelism, 2);
  tbb::task_arena arena(2);
  std::atomic<int> there{0};
  // Each of the two waits for the other, which one thread alone does in vain.
  arena.execute([&] {
    tbb::parallel_for(
        0, 2,
        [&](int) {
          ++there;
          const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
          while (there < 2 && std::chrono::steady_clock::now() < until) std::this_thread::yield();
          EXPECT_EQ(there, 2);
        },
        tbb::simple_partitioner());
  });
}

TEST(World, HitTellsTriangleDistanceBarycentricsAndSide) {
  const Scene scene = Square({});
  const auto world = Build(scene);
  TestRandom random(1);
  for (int i = 0; i < 100; ++i) {
    const float x = random.Between(-0.5f, 0.5f), y = random.Between(-0.5f, 0.5f);
    const Hit hit = world->Intersect(Down(x, y));
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit.t, 1, 1e-6);
    EXPECT_FALSE(hit.back);
    EXPECT_LT(Length(world->PointAt(hit).position - Vec3f{x, y, 0}), 1e-6f);
    EXPECT_EQ(world->PointAt(hit).normal, (Vec3f{0, 0, 1}));
    const Hit back = world->Intersect(Up(x, y));
    ASSERT_TRUE(back && back.back);
    EXPECT_EQ(world->PointAt(back).normal, (Vec3f{0, 0, -1}));
  }
  EXPECT_FALSE(world->Intersect(Down(0.6f, 0)));
}

// Triangles at one place about the origin, with corners in different orders.
Scene AtOnePlace(const std::vector<Material>& materials, const std::vector<bool>& face_down) {
  SceneBuilder builder;
  for (size_t k = 0; k < materials.size(); ++k) {
    const int index = builder.AddMaterial(materials[k]);
    const Vec3d o{-0.51, -0.53, 0.1}, x{1.01, 0, 0.03}, y{0, 1.07, 0.02};
    const Surface surface{.material = index, .lightmapped = false};
    if (face_down[k]) {
      builder.AddTriangle(o + y, o + x, o, surface);
    } else if (k % 2 == 0) {
      builder.AddTriangle(o, o + x, o + y, surface);
    } else {
      builder.AddTriangle(o + y, o, o + x, surface);
    }
  }
  return builder.Build();
}

Material Emitting(float radiance, float alpha = 1) {
  Material material;
  material.emission = {radiance, radiance, radiance};
  material.base_alpha = alpha;
  if (alpha < 1) material.alpha_mode = AlphaMode::kBlend;
  return material;
}

// Symptom: of triangles that coincide rays met whichever Embree came to, and its rounding favoured.
TEST(World, OfTrianglesThatCoincideRaysMeetFrontsThenTheBrightestThenTheFirst) {
  const Scene scene =
      AtOnePlace({Emitting(1), Emitting(0), Emitting(2), Emitting(2), Emitting(3)}, {false, false, false, false, true});
  const auto world = Build(scene);
  TestRandom random(3);
  for (int i = 0; i < 1000; ++i) {
    const float x = random.Between(-0.3f, 0.1f), y = random.Between(-0.3f, 0.1f);
    const Hit down = world->Intersect(Down(x, y)), up = world->Intersect(Up(x, y));
    ASSERT_TRUE(down && up);
    ASSERT_EQ(world->triangles()[down.triangle].object, 2u);
    ASSERT_EQ(world->triangles()[up.triangle].object, 4u);
    ASSERT_FALSE(down.back || up.back);
  }
}

TEST(World, OfTrianglesThatCoincideEachIsMetByItsShareOfTheRays) {
  // The third stops what the first two let pass; the fourth, last of those that look up, is never met from above.
  const Scene scene = AtOnePlace({Emitting(3, 0.25f), Emitting(2, 0.5f), Emitting(1), Emitting(0), Emitting(0, 0.5f)},
                                 {false, false, false, false, true});
  const auto world = Build(scene);
  std::array<double, 5> met{}, share{};
  constexpr uint32_t kRays = 100000;
  for (uint32_t key = 0; key < kRays; ++key) {
    const Hit hit = world->Intersect(Down(-0.1f, -0.1f, key));
    ASSERT_TRUE(hit);
    met[world->triangles()[hit.triangle].object] += 1.0 / kRays;
    share[world->triangles()[hit.triangle].object] =
        static_cast<double>(world->ShareMet(hit.triangle, hit.u, hit.v, hit.back));
  }
  const std::array<double, 5> right{0.25, 0.375, 0.375, 0, 0};
  for (size_t k = 0; k < right.size(); ++k) {
    EXPECT_NEAR(met[k], right[k], 0.008) << k;  // five standard deviations
    EXPECT_NEAR(share[k], right[k], 1e-6) << k;
  }
}

TEST(World, VisitsWhatIsNearUntilToldToStop) {
  TestRandom random(7);
  SceneBuilder builder;
  const auto place = [&] { return Vec3d{4 * random.Unit(), 4 * random.Unit(), 4 * random.Unit()}; };
  for (int i = 0; i < 200; ++i) {
    builder.AddQuad(place(), Vec3d{0.2, 0, 0} * random.Unit(), Vec3d{0, 0.1, 0.3} * random.Unit(),
                    {.lightmapped = false});
  }
  const Scene scene = builder.Build();
  const auto world = Build(scene);
  for (int i = 0; i < 50; ++i) {
    const Vec3f center = ToFloat(place());
    const float radius = 0.5f;
    std::set<uint32_t> expected, found;
    for (uint32_t k = 0; k < world->triangles().size(); ++k) {
      const Triangle& t = world->triangles()[k];
      float square = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const auto [least, most] = std::minmax({t.p0[axis], (t.p0 + t.e1)[axis], (t.p0 + t.e2)[axis]});
        square += std::pow(std::max({least - center[axis], center[axis] - most, 0.0f}), 2.0f);
      }
      if (square < radius * radius) expected.insert(k);
    }
    world->VisitNear(center, radius, [&](uint32_t triangle) { return found.insert(triangle).second; });
    EXPECT_EQ(found, expected);
    // Symptom: the others of a leaf were visited all the same.
    size_t visits = 0;
    world->VisitNear(center, radius, [&](uint32_t) { return ++visits < 2; });
    EXPECT_EQ(visits, std::min<size_t>(expected.size(), 2));
  }
}

TEST(RangeOver, HoldsEverySampleOfTheTriangle) {
  TestRandom random(9);
  int narrow = 0;
  for (int i = 0; i < 300; ++i) {
    Texture texture{16, 8, WrapMode::kRepeat, WrapMode::kMirroredRepeat, i % 2 == 0, {}};
    if (i % 3 == 0) texture.wrap_u = WrapMode::kClampToEdge;
    for (int k = 0; k < 16 * 8 * 4; ++k) texture.rgba.push_back(static_cast<uint8_t>(256 * random.Unit()));
    const float size = std::exp2(random.Between(-7, 1));
    TextureRef ref;
    ref.offset = {random.Between(-2, 2), random.Between(-2, 2)};
    ref.rotation_rad = random.Between(0, 6);
    std::array<Vec2f, 3> corners;
    for (Vec2f& corner : corners) corner = {random.Between(-3, 3) * size, random.Between(-3, 3) * size};
    const TexelRange range = RangeOver(texture, ref, corners, 65536);
    narrow += range.least_alpha > 0.02f || range.most_alpha < 0.98f ? 1 : 0;
    for (int k = 0; k < 100; ++k) {
      Vec2f b = random.Square();
      if (b.x + b.y > 1) b = {1 - b.x, 1 - b.y};
      const Vec2f uv = corners[0] * (1 - b.x - b.y) + corners[1] * b.x + corners[2] * b.y;
      const float alpha = SampleAlpha(texture, ref, uv);
      EXPECT_GE(alpha, range.least_alpha - 1e-5f);
      EXPECT_LE(alpha, range.most_alpha + 1e-5f);
      const Rgb color = SampleColor(texture, ref, uv);
      EXPECT_GE(color.y, range.least.y - 1e-5f);
      EXPECT_LE(color.y, range.most.y + 1e-5f);
    }
  }
  EXPECT_GT(narrow, 30) << "ranges that say something";
}

TEST(World, MaskLetsThroughWhereTheTextureIsBelowTheCutoff) {
  SceneBuilder builder;
  Texture texture{2, 1, WrapMode::kClampToEdge, WrapMode::kClampToEdge, true, {255, 255, 255, 100, 255, 255, 255, 200}};
  Material leaf;
  leaf.base_texture.texture = builder.AddTexture(texture);
  leaf.alpha_mode = AlphaMode::kMask;  // cutoff 0.5: 100/255 passes, 200/255 blocks
  const int index = builder.AddMaterial(leaf);
  builder.AddQuad({-0.5, -0.5, 0}, {1, 0, 0}, {0, 1, 0}, {.material = index, .lightmapped = false});
  const Scene scene = builder.Build();
  const auto world = Build(scene);
  TestRandom random(2);
  for (int i = 0; i < 1000; ++i) {
    const float x = random.Between(-0.49f, 0.49f), y = random.Between(-0.49f, 0.49f);
    if (std::fabs(x) < 1e-4f) continue;
    const auto key = static_cast<uint32_t>(i);
    EXPECT_EQ(static_cast<bool>(world->Intersect(Down(x, y, key))), x > 0) << x;
    EXPECT_EQ(world->Occluded(Down(x, y, key)), x > 0) << x;
  }
}

TEST(World, BlendLetsThroughTheShareThatAlphaLeaves) {
  for (const float alpha : {0.0f, 0.3f, 0.9f, 1.0f}) {
    Material glass;
    glass.alpha_mode = AlphaMode::kBlend;
    glass.base_alpha = alpha;
    const Scene scene = Square(glass);
    const auto world = Build(scene);
    constexpr uint32_t n = 20000;
    int blocked = 0;
    for (uint32_t key = 0; key < n; ++key) {
      const Ray ray = Down(0.1f, 0.2f, key * 2654435761u);
      blocked += world->Occluded(ray) ? 1 : 0;
      EXPECT_EQ(world->Occluded(ray), static_cast<bool>(world->Intersect(ray)));
    }
    const double p = static_cast<double>(alpha);
    EXPECT_NEAR(blocked / double{n}, p, 4 * std::sqrt(p * (1 - p) / n) + 1e-9) << alpha;  // four standard deviations
  }
}

TEST(World, TwoBlendSurfacesDecideIndependently) {
  SceneBuilder builder;
  Material glass;
  glass.alpha_mode = AlphaMode::kBlend;
  glass.base_alpha = 0.5f;
  const int index = builder.AddMaterial(glass);
  for (const double z : {-0.2, 0.2}) {
    builder.AddQuad({-0.5, -0.5, z}, {1, 0, 0}, {0, 1, 0}, {.material = index, .lightmapped = false});
  }
  const Scene scene = builder.Build();
  const auto world = Build(scene);
  constexpr uint32_t n = 20000;
  int passed = 0;
  for (uint32_t key = 0; key < n; ++key) passed += world->Occluded(Down(0.1f, 0.2f, key)) ? 0 : 1;
  EXPECT_NEAR(passed / double{n}, 0.25, 4 * std::sqrt(0.25 * 0.75 / n));
}

TEST(World, BackfacesReflectAbsorbOrPassAsTheModeSays) {
  for (const bool double_sided : {false, true}) {
    Material material;
    material.base_color = {0.5f, 0.5f, 0.5f};
    material.double_sided = double_sided;
    const Scene scene = Square(material);
    const auto reflect = Build(scene, BackfaceMode::kReflect), absorb = Build(scene, BackfaceMode::kAbsorb),
               pass = Build(scene, BackfaceMode::kPass);
    for (const auto* world : {&reflect, &absorb, &pass}) {
      const Hit front = (*world)->Intersect(Down(0.1f, 0.2f));
      ASSERT_TRUE(front);
      EXPECT_EQ((*world)->AlbedoAt(front).x, 0.5f);
    }
    EXPECT_EQ(reflect->AlbedoAt(reflect->Intersect(Up(0.1f, 0.2f))).x, 0.5f);
    EXPECT_EQ(absorb->AlbedoAt(absorb->Intersect(Up(0.1f, 0.2f))).x, double_sided ? 0.5f : 0.0f);
    EXPECT_EQ(static_cast<bool>(pass->Intersect(Up(0.1f, 0.2f))), double_sided);
    EXPECT_EQ(pass->Occluded(Up(0.1f, 0.2f)), double_sided);
  }
}

TEST(World, EmissionLeavesTheFrontUnlessDoubleSided) {
  for (const bool double_sided : {false, true}) {
    Material lamp;
    lamp.emission = {3, 3, 3};
    lamp.double_sided = double_sided;
    const Scene scene = Square(lamp);
    const auto world = Build(scene);
    EXPECT_EQ(world->EmissionAt(world->Intersect(Down(0.1f, 0.2f))).x, 3);
    EXPECT_EQ(world->EmissionAt(world->Intersect(Up(0.1f, 0.2f))).x, double_sided ? 3 : 0);
  }
}

TEST(World, DegenerateTrianglesAreLeftOut) {
  SceneBuilder builder;
  builder.AddTriangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {.lightmapped = false});
  builder.AddTriangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {.lightmapped = false});
  Scene scene = builder.Build();
  scene.objects.push_back(scene.objects[1]);
  scene.objects[2].position[0].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Build(scene)->triangles().size(), 1u);
}

// Triangles of about `size` m within ten sizes of the origin; every third is a sliver 30 times as long as wide. (At
// 1000 times, 8 of 100,000 rays meet their own triangle: the single precision cross product of its edges then leans by
// more than the offset allows for.)
Scene Soup(float size, uint32_t seed) {
  TestRandom random(seed);
  SceneBuilder builder;
  for (int i = 0; i < 1000; ++i) {
    const Vec3f at = random.InCube(10 * size), e1 = random.Direction() * (size * random.Between(0.1f, 1.0f));
    Vec3f e2 = random.Direction() * (size * random.Between(0.1f, 1.0f));
    constexpr float kSlenderness[] = {30, 1e3f, 1e5f};
    if (i % 2 == 0) e2 = e1 * 0.7f + FrameFromNormal(NormalizeOrZero(e1)).t * (Length(e1) / kSlenderness[i / 2 % 3]);
    builder.AddTriangle(ToDouble(at), ToDouble(at + e1), ToDouble(at + e2), {.lightmapped = false});
  }
  return builder.Build();
}

TEST(World, RaysThatLeaveASurfaceNeverHitIt) {
  TestRandom random(5);
  for (const float size : {1e-3f, 1e-2f, 1.0f, 100.0f, 1e4f}) {
    const Scene scene = Soup(size, 6);
    const auto world = Build(scene);
    int own = 0;
    for (int i = 0; i < 60000; ++i) {
      const auto k = static_cast<uint32_t>(i) % static_cast<uint32_t>(world->triangles().size());
      const Vec2f b{random.Unit(), random.Unit()};
      const bool outside = b.x + b.y > 1;
      const bool back = i % 2 == 0;
      const SurfacePoint point = world->PointAt(k, outside ? 1 - b.x : b.x, outside ? 1 - b.y : b.y, back);
      const Frame frame = FrameFromNormal(point.normal);
      const float phi = random.Between(0, 2 * kPiF), elevation = std::pow(10.0f, random.Between(-7, 0));
      const Vec3f dir = NormalizeOrZero(frame.ToWorld({std::cos(phi), std::sin(phi), elevation}));
      if (Dot(dir, world->triangles()[k].normal) * (back ? -1.0f : 1.0f) <= 0) continue;  // rounded to below it
      const Hit hit = world->Intersect(RayFrom(point, dir, kInfinity, 0));
      own += hit.triangle == k ? 1 : 0;
    }
    EXPECT_EQ(own, 0) << "size " << size;
  }
}

TEST(World, ShortestOffsetStaysFarBelowTheTriangle) {
  // The other side of the same bargain: what starts above a surface must not start above what lies on it.
  const Scene scene = Soup(1, 7);
  const auto world = Build(scene);
  for (uint32_t k = 0; k < world->triangles().size(); ++k) EXPECT_LT(world->PointAt(k, 0, 0, false).offset, 1e-4f);
}

}  // namespace
}  // namespace bakewell
