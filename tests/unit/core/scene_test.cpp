#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scene/canonical.h"
#include "core/scene/mean_point.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

// Something of everything.
Scene RichScene() {
  SceneBuilder builder({64, 32});
  Texture texture{2, 1, WrapMode::kMirroredRepeat, WrapMode::kClampToEdge, true, {1, 2, 3, 4, 5, 6, 7, 8}};
  Material leaf;
  leaf.name = "leaf";
  leaf.base_texture = {builder.AddTexture(texture), 1, {0.5f, 0}, {2, 2}, 0.25f};
  leaf.alpha_mode = AlphaMode::kMask;
  const int leaf_index = builder.AddMaterial(leaf);
  const int lamp = builder.AddMaterial({0, 0, 0}, {10, 9, 8});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {leaf_index, true, {2, 2, 8, 8}, "floor"});
  builder.AddBox({2, 0, 0}, {3, 1, 1}, {lamp, false, {}, "lamp"});
  builder.AddSphere({0, 5, 0}, 0.5, 4);
  builder.AddPointLight({0, 3, 0}, {1, 2, 3});
  builder.AddSpotLight({1, 3, 0}, {0, -1, 0}, {4, 4, 4}, 0.25, 0.5);
  builder.AddDirectionalLight({0, -1, 1}, {5, 5, 5}, 0.00925);
  builder.SetConstantSky({0.5f, 0.5f, 1});
  return builder.BuildCanonical();
}

TEST(SceneBytes, RoundTripIsExactAndKeepsNames) {
  const Scene scene = RichScene();
  const std::vector<std::byte> bytes = SerializeScene(scene);
  const auto parsed = ParseScene(bytes);
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(SerializeScene(*parsed), bytes);
  EXPECT_EQ(SceneDigest(*parsed), SceneDigest(scene));
  for (size_t i = 0; i < scene.objects.size(); ++i) EXPECT_EQ(parsed->objects[i].name, scene.objects[i].name);
  EXPECT_EQ(parsed->textures[0].rgba, scene.textures[0].rgba);
  EXPECT_EQ(parsed->lightmap_page->width, 64);
}

TEST(SceneBytes, WorkedExampleOfThePageHasItsBytes) {
  // schema/scene.md: an empty scene.
  const std::vector<std::byte> bytes = SerializeScene(Scene{});
  ASSERT_EQ(bytes.size(), 137u);
  const uint8_t head[] = {'B', 'W', 'S', 'C', 1, 0, 0, 0};
  EXPECT_TRUE(std::equal(std::begin(head), std::end(head), reinterpret_cast<const uint8_t*>(bytes.data())));
  EXPECT_TRUE(std::all_of(bytes.begin() + 8, bytes.end(), [](std::byte b) { return b == std::byte{0}; }));
}

TEST(SceneBytes, EveryPrefixIsDataLoss) {
  const std::vector<std::byte> bytes = SerializeScene(RichScene());
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto parsed = ParseScene(std::span(bytes).first(size));
    ASSERT_EQ(parsed.status().code(), absl::StatusCode::kDataLoss) << size << " of " << bytes.size();
  }
}

TEST(SceneBytes, BitFlipsNeverCrash) {
  const std::vector<std::byte> bytes = SerializeScene(RichScene());
  int refused = 0;
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::vector<std::byte> flipped = bytes;
    flipped[bit / 8] ^= std::byte{1} << static_cast<int>(bit % 8);
    const auto parsed = ParseScene(flipped);
    refused += !parsed.ok();
    // What is accepted says what it was read from.
    if (!parsed.ok()) continue;
    ASSERT_EQ(SerializeScene(*parsed), flipped) << bit;
  }
  EXPECT_GT(refused, 100);
}

TEST(SceneBytes, OtherVersionIsAFailedPrecondition) {
  std::vector<std::byte> bytes = SerializeScene(Scene{});
  bytes[4] = std::byte{2};
  EXPECT_EQ(ParseScene(bytes).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(SceneBytes, HugeCountsAllocateNothing) {
  std::vector<std::byte> bytes = SerializeScene(Scene{});
  // The number of textures; sum it with nothing that is there.
  for (size_t i = 105; i < 113; ++i) bytes[i] = std::byte{0xFF};
  EXPECT_EQ(ParseScene(bytes).status().code(), absl::StatusCode::kDataLoss);
}

TEST(SceneBytes, NumbersThatAreNotFiniteAreDataLoss) {
  Scene scene = RichScene();
  scene.objects[0].position[1].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(ParseScene(SerializeScene(scene)).status().code(), absl::StatusCode::kDataLoss);
}

TEST(SceneBytes, LightBeyondWhatVariancesHoldIsDataLoss) {
  for (int what = 0; what < 4; ++what) {
    for (const float bad : {1.1e15f, 3e19f, -1.0f}) {
      Scene scene = RichScene();
      scene.environment.latlong = {{1, 1, 1}};
      scene.environment.width = scene.environment.height = 1;
      Rgb* const lights[] = {&scene.lights[0].intensity, &scene.materials[0].emission, &scene.environment.zenith,
                             &scene.environment.latlong[0]};
      lights[what]->y = 1e15f;
      EXPECT_TRUE(ParseScene(SerializeScene(scene)).ok()) << what;
      lights[what]->y = bad;
      EXPECT_EQ(ParseScene(SerializeScene(scene)).status().code(), absl::StatusCode::kDataLoss) << what << ", " << bad;
    }
  }
}

TEST(Canonicalize, OrderOfTheInputChangesNothing) {
  const Scene scene = RichScene();
  Scene shuffled = scene;
  std::reverse(shuffled.objects.begin(), shuffled.objects.end());
  std::reverse(shuffled.lights.begin(), shuffled.lights.end());
  std::reverse(shuffled.materials.begin(), shuffled.materials.end());
  for (Object& object : shuffled.objects)
    object.material = static_cast<int>(scene.materials.size()) - 1 - object.material;
  Canonicalize(shuffled);
  EXPECT_EQ(SerializeScene(shuffled), SerializeScene(scene));
}

TEST(Canonicalize, UnusedAndEqualMaterialsVanish) {
  SceneBuilder builder;
  const int red = builder.AddMaterial({1, 0, 0});
  const int same_red = builder.AddMaterial({1, 0, 0});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {red, true, {}, ""});
  builder.AddQuad({0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {same_red, true, {}, ""});
  const Scene scene = builder.BuildCanonical();
  EXPECT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.objects[0].material, 0);
  EXPECT_EQ(scene.objects[1].material, 0);
}

TEST(SceneDigest, NamesDoNotCountAndContentDoes) {
  const Scene scene = RichScene();
  Scene renamed = scene, moved = scene;
  renamed.objects[0].name = "other";
  renamed.objects[0].source.node = 99;
  moved.objects[0].position[0].x += 1;
  EXPECT_EQ(SceneDigest(renamed), SceneDigest(scene));
  EXPECT_NE(SceneDigest(moved), SceneDigest(scene));
}

TEST(MeanPoint, IsExactInAnyOrder) {
  std::vector<Vec3d> points;
  for (int i = 0; i < 1000; ++i) points.push_back({1e8 / (i + 1), std::sin(i), -1e-3 * i});
  MeanPoint forth, back;
  for (size_t i = 0; i < points.size(); ++i) {
    forth.Add(points[i]);
    back.Add(points[points.size() - 1 - i]);
  }
  EXPECT_EQ(forth.Value(), back.Value());
  EXPECT_EQ(MeanPoint().Value(), (Vec3d{0, 0, 0}));
}

double SignedVolume(const Scene& scene) {
  double volume = 0;
  for (const Object& object : scene.objects) {
    for (size_t t = 0; t < object.index.size(); t += 3) {
      const Vec3d a = ToDouble(object.position[object.index[t]]), b = ToDouble(object.position[object.index[t + 1]]);
      volume += Dot(a, Cross(b, ToDouble(object.position[object.index[t + 2]]))) / 6;
    }
  }
  return volume;
}

TEST(SceneBuilder, SolidsAreClosedAndLookOutwards) {
  SceneBuilder box, room, sphere;
  box.AddBox({0, 0, 0}, {1, 2, 3});
  room.AddRoom({0, 0, 0}, {1, 2, 3});
  sphere.AddSphere({0, 0, 0}, 1, 64);
  EXPECT_NEAR(SignedVolume(box.Build()), 6, 1e-5);
  EXPECT_NEAR(SignedVolume(room.Build()), -6, 1e-5);
  // 64 rows leave the polyhedron 0.2 % short of the ball.
  EXPECT_NEAR(SignedVolume(sphere.Build()), 4 * kPi / 3, 0.01);
}

TEST(SceneBuilder, QuadCoversItsRectangleOfThePage) {
  SceneBuilder builder({64, 32});
  builder.AddQuad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, true, {8, 4, 16, 8}, ""});
  const Object quad = builder.Build().objects[0];
  EXPECT_EQ(quad.uv1[0], (Vec2f{0.125f, 0.125f}));
  EXPECT_EQ(quad.uv1[2], (Vec2f{0.375f, 0.375f}));
  EXPECT_EQ(quad.normal[0], (Vec3f{0, 0, 1}));
}

}  // namespace
}  // namespace bakewell
