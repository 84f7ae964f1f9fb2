#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/gltf/level.h"
#include "core/scene/canonical.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr float kHalf = 0.5f;

LoadedLevel MustLoad(const GltfBuilder& builder, const char* name = "level.glb") {
  const TempDir folder;
  auto level = LoadLevel(builder.Write(folder / name));
  EXPECT_TRUE(level.ok()) << level.status();
  return level.ok() ? *std::move(level) : LoadedLevel{};
}

Vec3d WorldPosition(const Scene& scene, size_t object, size_t vertex) {
  return scene.origin_ws + ToDouble(scene.objects[object].position[vertex]);
}

// The geometric normal of triangle 0, not normalised.
Vec3f Front(const Object& object) {
  const Vec3f a = object.position[object.index[0]];
  return Cross(object.position[object.index[1]] - a, object.position[object.index[2]] - a);
}

void ExpectNear(Vec3d a, Vec3d b, double tolerance = 1e-6) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

void ExpectWarning(const LoadedLevel& level, const std::string& text) {
  EXPECT_THAT(level.warnings, testing::Contains(HasSubstr(text)));
}

TEST(LoadLevel, QuadArrivesAsItIsFromGlbAndGltf) {
  for (const char* name : {"level.glb", "level.gltf"}) {
    const LoadedLevel level = MustLoad(QuadGltf(), name);
    ASSERT_EQ(level.scene.objects.size(), 1u);
    const Object& quad = level.scene.objects[0];
    EXPECT_EQ(quad.name, "quad");
    EXPECT_TRUE(quad.lightmapped);
    ExpectNear(level.scene.origin_ws, {kHalf, kHalf, 0});
    ExpectNear(WorldPosition(level.scene, 0, 2), {1, 1, 0});
    EXPECT_EQ(quad.normal[0], (Vec3f{0, 0, 1}));
    EXPECT_EQ(quad.uv0[2], (Vec2f{1, 1}));
    EXPECT_EQ(quad.uv1[2], (Vec2f{kHalf, kHalf}));
    EXPECT_THAT(quad.index, ElementsAre(0, 1, 2, 0, 2, 3));
    EXPECT_EQ(quad.source.node, 0);
    EXPECT_EQ(quad.source.instance, -1);
    EXPECT_TRUE(level.warnings.empty());
    EXPECT_TRUE(level.geometry.empty());
  }
}

TEST(LoadLevel, HierarchyMultipliesParentsFromTheLeft) {
  GltfBuilder builder = QuadGltf();
  // Parent: a quarter turn about +y, then 10 along x. Child: scaled by (2, 3, 1).
  const double s = std::sqrt(0.5);
  builder.json["nodes"][0]["scale"] = {2, 3, 1};
  builder.json["nodes"].push_back({{"children", {0}}, {"rotation", {0, s, 0, s}}, {"translation", {10, 0, 0}}});
  builder.json["scenes"][0]["nodes"] = {1};
  const Scene scene = MustLoad(builder).scene;
  // (1, 1, 0) -> (2, 3, 0) -> x becomes -z.
  ExpectNear(WorldPosition(scene, 0, 2), {10, 3, -2});
  ExpectNear(ToDouble(scene.objects[0].normal[0]), {1, 0, 0});
}

TEST(LoadLevel, MatrixEqualsTrs) {
  GltfBuilder trs = QuadGltf(), matrix = QuadGltf();
  const double s = std::sqrt(0.5);
  trs.json["nodes"][0].update({{"translation", {1, 2, 3}}, {"rotation", {s, 0, 0, s}}, {"scale", {2, 3, 4}}});
  matrix.json["nodes"][0]["matrix"] = {2, 0, 0, 0, 0, 0, 3, 0, 0, -4, 0, 0, 1, 2, 3, 1};
  const Scene a = MustLoad(trs).scene, b = MustLoad(matrix).scene;
  for (size_t i = 0; i < 4; ++i) {
    ExpectNear(WorldPosition(a, 0, i), WorldPosition(b, 0, i));
    ExpectNear(ToDouble(a.objects[0].normal[i]), ToDouble(b.objects[0].normal[i]));
  }
}

TEST(LoadLevel, MirroringKeepsTheFrontWhereTheNormalIs) {
  for (const json& scale : {json{-1, 1, 1}, json{1, 1, -1}, json{-1, -1, -1}, json{-2, 1, 1}}) {
    GltfBuilder builder = QuadGltf();
    builder.json["nodes"][0]["scale"] = scale;
    const Scene scene = MustLoad(builder).scene;
    EXPECT_GT(Dot(Front(scene.objects[0]), scene.objects[0].normal[0]), 0) << scale;
  }
}

TEST(LoadLevel, NonUniformScaleTurnsNormalsByTheInverseTranspose) {
  GltfBuilder builder = QuadGltf();
  // The quad's plane tilted to x + z = const by hand: positions and a normal along (1, 0, 1).
  builder.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
      builder.AddVec3({{0, 0, 1}, {1, 0, 0}, {1, 1, 0}, {0, 1, 1}});
  const float s = std::sqrt(0.5f);
  builder.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      builder.AddVec3({{s, 0, s}, {s, 0, s}, {s, 0, s}, {s, 0, s}});
  builder.json["nodes"][0]["scale"] = {4, 1, 1};
  const Object quad = MustLoad(builder).scene.objects[0];
  const Vec3f front = NormalizeOrZero(Front(quad));
  EXPECT_NEAR(Dot(front, quad.normal[0]), 1, 1e-6);
}

TEST(LoadLevel, MissingNormalsAreFlatAndUnshareVertices) {
  GltfBuilder builder = QuadGltf();
  builder.json["meshes"][0]["primitives"][0]["attributes"].erase("NORMAL");
  builder.json["nodes"][0]["scale"] = {-1, 1, 1};
  const Object quad = MustLoad(builder).scene.objects[0];
  ASSERT_EQ(quad.position.size(), 6u);
  for (const Vec3f& n : quad.normal) EXPECT_EQ(n, (Vec3f{0, 0, 1}));
  EXPECT_EQ(quad.uv0[4], (Vec2f{1, 1}));
}

TEST(LoadLevel, StripsAndFansGiveTheSameTriangles) {
  GltfBuilder strip = QuadGltf(), fan = QuadGltf(), unindexed = QuadGltf();
  // The repeated index stitches; it makes no triangle.
  strip.json["meshes"][0]["primitives"][0].update({{"indices", strip.AddIndices({0, 1, 3, 2, 2})}, {"mode", 5}});
  fan.json["meshes"][0]["primitives"][0].update({{"indices", fan.AddIndices({0, 1, 2, 3})}, {"mode", 6}});
  unindexed.json["meshes"][0]["primitives"][0].erase("indices");
  unindexed.json["meshes"][0]["primitives"][0]["mode"] = 6;
  for (const GltfBuilder& builder : {strip, fan, unindexed}) {
    const LoadedLevel level = MustLoad(builder);
    ASSERT_EQ(level.scene.objects[0].index.size(), 6u);
    double area = 0;
    for (size_t t = 0; t < 2; ++t) {
      Object triangle = level.scene.objects[0];
      triangle.index.erase(triangle.index.begin(), triangle.index.begin() + static_cast<std::ptrdiff_t>(3 * t));
      EXPECT_GT(Front(triangle).z, 0);
      area += 0.5 * Front(triangle).z;
    }
    EXPECT_DOUBLE_EQ(area, 1);
    EXPECT_TRUE(level.warnings.empty());
  }
}

// The quad's corners in some component type: positions as integers 0 and 1, or normalised to the type's maximum.
template <typename T>
GltfBuilder QuadOf(int component_type, bool normalized, T one) {
  GltfBuilder builder = QuadGltf();
  const std::vector<T> numbers = {0, 0, 0, 0, one, 0, 0, 0, one, one, 0, 0, 0, one, 0, 0};
  // Four components apart: a stride that no type needs.
  const int view = builder.AddView(std::as_bytes(std::span(numbers)), 4 * sizeof(T));
  builder.json["accessors"][0].update(
      {{"bufferView", view}, {"componentType", component_type}, {"normalized", normalized}});
  return builder;
}

TEST(LoadLevel, EveryComponentTypeIsReadWithStride) {
  const std::vector<GltfBuilder> builders = {QuadOf<int8_t>(5120, false, 1),     QuadOf<uint8_t>(5121, false, 1),
                                             QuadOf<int16_t>(5122, false, 1),    QuadOf<uint16_t>(5123, false, 1),
                                             QuadOf<uint32_t>(5125, false, 1),   QuadOf<float>(5126, false, 1),
                                             QuadOf<int8_t>(5120, true, 127),    QuadOf<uint8_t>(5121, true, 255),
                                             QuadOf<int16_t>(5122, true, 32767), QuadOf<uint16_t>(5123, true, 65535)};
  for (const GltfBuilder& builder : builders) {
    const Scene scene = MustLoad(builder).scene;
    ExpectNear(WorldPosition(scene, 0, 2), {1, 1, 0});
    ExpectNear(WorldPosition(scene, 0, 3), {0, 1, 0});
  }
}

TEST(LoadLevel, IndicesOfEveryWidthAreRead) {
  const std::vector<uint8_t> bytes = {0, 1, 2, 0, 2, 3};
  const std::vector<uint16_t> shorts(bytes.begin(), bytes.end());
  GltfBuilder narrow = QuadGltf(), medium = QuadGltf();
  narrow.json["meshes"][0]["primitives"][0]["indices"] =
      narrow.AddAccessor(std::as_bytes(std::span(bytes)), 5121, "SCALAR", 6);
  medium.json["meshes"][0]["primitives"][0]["indices"] =
      medium.AddAccessor(std::as_bytes(std::span(shorts)), 5123, "SCALAR", 6);
  for (const GltfBuilder& builder : {narrow, medium}) {
    EXPECT_THAT(MustLoad(builder).scene.objects[0].index, ElementsAre(0, 1, 2, 0, 2, 3));
  }
}

TEST(LoadLevel, SparseValuesReplaceOnesFromTheViewAndZeros) {
  for (const bool backed : {true, false}) {
    GltfBuilder builder = QuadGltf();
    const std::vector<uint16_t> where = backed ? std::vector<uint16_t>{2} : std::vector<uint16_t>{1, 2, 3};
    const std::vector<Vec3f> what =
        backed ? std::vector<Vec3f>{{1, 5, 0}} : std::vector<Vec3f>{{1, 0, 0}, {1, 5, 0}, {0, 1, 0}};
    const int indices = builder.AddView(std::as_bytes(std::span(where)));
    const int values = builder.AddView(std::as_bytes(std::span(what)));
    builder.json["accessors"][0]["sparse"] = {{"count", where.size()},
                                              {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                              {"values", {{"bufferView", values}}}};
    if (!backed) builder.json["accessors"][0].erase("bufferView");
    const Scene scene = MustLoad(builder).scene;
    ExpectNear(WorldPosition(scene, 0, 1), {1, 0, 0});
    ExpectNear(WorldPosition(scene, 0, 2), {1, 5, 0});
    ExpectNear(WorldPosition(scene, 0, 3), {0, 1, 0});
  }
}

TEST(LoadLevel, InstancesOfBothKindsAreExpanded) {
  GltfBuilder builder = QuadGltf();
  builder.AddNode({{"mesh", 0}, {"translation", {0, 0, 5}}});
  const int translation = builder.AddVec3({{1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
  const int scale = builder.AddVec3({{1, 1, 1}, {1, 1, 1}, {-1, 1, 1}});
  builder.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  builder.json["nodes"][0]["translation"] = {0, 7, 0};
  builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", translation},
                                                                                     {"SCALE", scale}};
  const Scene scene = MustLoad(builder).scene;
  ASSERT_EQ(scene.objects.size(), 4u);
  bool seen[3] = {};
  for (size_t i = 0; i < 4; ++i) {
    const int instance = scene.objects[i].source.instance;
    if (instance < 0) continue;
    seen[instance] = true;
    ExpectNear(WorldPosition(scene, i, 0), {1.0 + instance, 7, 0});
    EXPECT_GT(Front(scene.objects[i]).z, 0);
  }
  EXPECT_TRUE(seen[0] && seen[1] && seen[2]);
}

TEST(LoadLevel, MaterialFactorsAndModesArrive) {
  GltfBuilder builder = QuadGltf();
  builder.AddMaterial({{"name", "glass"},
                       {"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0}}},
                       {"emissiveFactor", {1, 0.5, 0}},
                       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 10}}}}},
                       {"alphaMode", "BLEND"},
                       {"alphaCutoff", 0.25},
                       {"doubleSided", true}});
  builder.json["meshes"][0]["primitives"][0]["material"] = 0;
  const LoadedLevel level = MustLoad(builder);
  const Material& material = level.scene.materials.at(0);
  EXPECT_EQ(material.name, "glass");
  EXPECT_EQ(material.base_color, (Rgb{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(material.base_alpha, 0.4f);
  EXPECT_EQ(material.emission, (Rgb{10, 5, 0}));
  EXPECT_EQ(material.alpha_mode, AlphaMode::kBlend);
  EXPECT_EQ(material.alpha_cutoff, 0.25f);
  EXPECT_TRUE(material.double_sided);
  EXPECT_TRUE(level.warnings.empty());
}

TEST(LoadLevel, DefaultMaterialIsWhiteAndOpaque) {
  const Scene scene = MustLoad(QuadGltf()).scene;
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].base_color, (Rgb{1, 1, 1}));
  EXPECT_EQ(scene.materials[0].alpha_mode, AlphaMode::kOpaque);
}

TEST(LoadLevel, TexturesArriveWithSamplerAndTransform) {
  GltfBuilder builder = QuadGltf();
  const std::vector<uint8_t> pixels = {255, 0, 0, 255, 0, 255, 0, 128};
  const int texture = builder.AddTexture(EncodePng(2, 1, pixels));
  builder.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  builder.json["textures"][0]["sampler"] = 0;
  builder.AddMaterial(
      {{"pbrMetallicRoughness",
        {{"baseColorTexture",
          {{"index", texture},
           {"extensions",
            {{"KHR_texture_transform", {{"offset", {0.5, 0.25}}, {"scale", {2, 3}}, {"rotation", 0.75}}}}}}}}},
       {"emissiveFactor", {1, 1, 1}},
       {"emissiveTexture", {{"index", texture}, {"texCoord", 1}}}});
  builder.json["meshes"][0]["primitives"][0]["material"] = 0;
  const Scene scene = MustLoad(builder).scene;
  ASSERT_EQ(scene.textures.size(), 1u);
  EXPECT_EQ(scene.textures[0].width, 2);
  EXPECT_EQ(scene.textures[0].height, 1);
  EXPECT_EQ(scene.textures[0].rgba, pixels);
  EXPECT_EQ(scene.textures[0].wrap_u, WrapMode::kClampToEdge);
  EXPECT_EQ(scene.textures[0].wrap_v, WrapMode::kMirroredRepeat);
  EXPECT_TRUE(scene.textures[0].nearest);
  const Material& material = scene.materials[0];
  EXPECT_EQ(material.base_texture.texture, 0);
  EXPECT_EQ(material.base_texture.offset, (Vec2f{0.5f, 0.25f}));
  EXPECT_EQ(material.base_texture.scale, (Vec2f{2, 3}));
  EXPECT_EQ(material.base_texture.rotation_rad, 0.75f);
  EXPECT_EQ(material.emission_texture.texture, 0);
  EXPECT_EQ(material.emission_texture.texcoord, 1);
}

TEST(LoadLevel, LightsAreRadiometricAndPlacedByTheirNode) {
  GltfBuilder builder = QuadGltf();
  builder.AddLight({{"type", "point"}, {"color", {1, 0.5, 0}}, {"intensity", 8}});
  builder.AddLight({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}});
  builder.AddLight({{"type", "directional"}, {"intensity", 60}, {"extras", {{"angularDiameterDeg", 0.53}}}});
  const double s = std::sqrt(0.5);
  for (int i = 0; i < 3; ++i) {
    builder.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}},
                     {"translation", {1, 2, 3}},
                     {"rotation", {-s, 0, 0, s}}});  // -z turns to -y
  }
  const Scene scene = MustLoad(builder).scene;
  ASSERT_EQ(scene.lights.size(), 3u);
  for (const PunctualLight& light : scene.lights) {
    ExpectNear(ToDouble(light.direction), {0, -1, 0});
    ExpectNear(ToDouble(light.tangent), {1, 0, 0});
    if (light.type != LightType::kDirectional) ExpectNear(scene.origin_ws + ToDouble(light.position), {1, 2, 3});
    if (light.type == LightType::kPoint) {
      EXPECT_EQ(light.intensity, (Rgb{8, 4, 0}));
    }
    if (light.type == LightType::kSpot) {
      EXPECT_FLOAT_EQ(light.cos_inner, std::cos(0.25f));
      EXPECT_FLOAT_EQ(light.cos_outer, std::cos(0.5f));
      EXPECT_EQ(light.intensity, (Rgb{1, 1, 1}));
    }
    if (light.type == LightType::kDirectional) {
      EXPECT_EQ(light.intensity, (Rgb{60, 60, 60}));
      EXPECT_FLOAT_EQ(light.angular_diameter_rad, static_cast<float>(0.53 * kPi / 180));
    }
  }
}

TEST(LoadLevel, EnvironmentPageAndNodeExtrasAreRead) {
  GltfBuilder builder = QuadGltf();
  builder.json["scenes"][0]["extras"] = {
      {"environment", {{"type", "gradient"}, {"zenith", {1, 2, 3}}, {"horizon", {4, 5, 6}}, {"ground", {7, 8, 9}}}},
      {"lightmap", {{"width", 64}, {"height", 32}}}};
  builder.json["nodes"][0]["extras"] = {{"lightmapped", false}, {"lightmapDensity", 2.5}};
  const Scene scene = MustLoad(builder).scene;
  EXPECT_EQ(scene.environment.type, EnvironmentType::kGradient);
  EXPECT_EQ(scene.environment.zenith, (Rgb{1, 2, 3}));
  EXPECT_EQ(scene.environment.horizon, (Rgb{4, 5, 6}));
  EXPECT_EQ(scene.environment.ground, (Rgb{7, 8, 9}));
  ASSERT_TRUE(scene.lightmap_page);
  EXPECT_EQ(scene.lightmap_page->width, 64);
  EXPECT_EQ(scene.lightmap_page->height, 32);
  EXPECT_FALSE(scene.objects[0].lightmapped);
  EXPECT_EQ(scene.objects[0].density, 2.5f);

  builder.json["scenes"][0]["extras"]["environment"] = {{"type", "constant"}, {"radiance", {1, 1, 2}}};
  EXPECT_EQ(MustLoad(builder).scene.environment.radiance, (Rgb{1, 1, 2}));
  builder.json["scenes"][0]["extras"]["environment"] = {{"type", "none"}};
  EXPECT_EQ(MustLoad(builder).scene.environment.type, EnvironmentType::kNone);
}

TEST(LoadLevel, ExtrasOfOtherKindsAreNobodysBusiness) {
  GltfBuilder builder = QuadGltf();
  builder.json["nodes"][0]["extras"] = "a string";
  builder.json["scenes"][0]["extras"] = {1, 2, 3};
  EXPECT_TRUE(MustLoad(builder).scene.objects[0].lightmapped);
}

TEST(LoadLevel, BadTrianglesAreCollapsedCountedAndReported) {
  GltfBuilder builder = QuadGltf();
  const float nan = std::nanf("");
  builder.json["meshes"][0]["primitives"][0] = {
      {"attributes",
       {{"POSITION", builder.AddVec3({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {nan, 1, 0}, {0.5f, 0, 0}})},
        {"NORMAL", builder.AddVec3({{0, 0, 1}, {0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}})}}},
      // Good, not a number, thin as a line, the first again.
      {"indices", builder.AddIndices({0, 1, 2, 0, 2, 3, 0, 4, 1, 1, 2, 0})}};
  const LoadedLevel level = MustLoad(builder);
  const Object& object = level.scene.objects[0];
  EXPECT_THAT(object.index, ElementsAre(0, 1, 2, 0, 0, 0, 0, 0, 0, 1, 1, 1));
  for (const Vec3f& p : object.position) EXPECT_TRUE(IsFinite(p));
  for (const Vec3f& n : object.normal) EXPECT_NEAR(Length(n), 1, 1e-6);
  ASSERT_EQ(level.geometry.size(), 1u);
  const ObjectReport& report = level.geometry[0];
  EXPECT_EQ(report.object, "nodes[0] \"quad\" primitives[0]");
  EXPECT_EQ(report.triangles, 4);
  EXPECT_EQ(report.non_finite, 1);
  EXPECT_EQ(report.degenerate, 1);
  EXPECT_EQ(report.duplicate, 1);
  EXPECT_EQ(report.bad_normals, 1);
  EXPECT_TRUE(report.lacks_uv1);
  ExpectWarning(level, "1 triangles without area");
  ExpectWarning(level, "1 triangles that repeat");
}

TEST(LoadLevel, WhatIsIgnoredIsSaidOnce) {
  GltfBuilder builder = QuadGltf();
  builder.json["extensionsUsed"] = {"KHR_materials_transmission"};
  builder.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
  builder.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 0}});
  builder.json["meshes"][0]["primitives"].push_back(
      {{"attributes", {{"POSITION", 0}}}, {"targets", {{{"POSITION", 0}}}}});
  builder.json["skins"] = {{{"joints", {0}}}};
  builder.AddNode({{"mesh", 0}});
  builder.AddNode({{"mesh", 0}, {"skin", 0}});
  const LoadedLevel level = MustLoad(builder);
  EXPECT_EQ(level.scene.objects.size(), 2u);
  ExpectWarning(level, "KHR_materials_transmission is ignored");
  ExpectWarning(level, "is made of lines");
  ExpectWarning(level, "is made of points");
  ExpectWarning(level, "has morph targets");
  ExpectWarning(level, "skinned");
  EXPECT_EQ(level.warnings.size(), 5u);
}

TEST(LoadLevel, MovedByTenKilometresGivesTheSameFloats) {
  GltfBuilder here = QuadGltf(), there = QuadGltf();
  there.json["nodes"][0]["translation"] = {10000, -500, 10000};
  const Scene a = MustLoad(here).scene, b = MustLoad(there).scene;
  for (size_t i = 0; i < 4; ++i)
    ExpectNear(ToDouble(a.objects[0].position[i]), ToDouble(b.objects[0].position[i]), 1e-7);
  ExpectNear(b.origin_ws - a.origin_ws, {10000, -500, 10000}, 1e-9);
}

TEST(LoadLevel, OrderOfNodesMeshesAndMaterialsChangesNothing) {
  // Three quads of three materials; the second file has everything in reverse.
  const auto build = [](bool reverse) {
    GltfBuilder builder = QuadGltf();
    const json primitive = builder.json["meshes"][0]["primitives"][0];
    builder.json["meshes"] = json::array();
    builder.json["nodes"] = json::array();
    builder.json["scenes"][0]["nodes"] = json::array();
    for (int i = 0; i < 3; ++i) {
      const int k = reverse ? 2 - i : i;
      builder.AddMaterial({{"emissiveFactor", {0.5 * k, 0, 0}}});
      builder.AddLight({{"type", "point"}, {"intensity", 1 + k}});
      json copy = primitive;
      copy["material"] = i;
      builder.json["meshes"].push_back({{"primitives", {copy}}});
      builder.AddNode({{"mesh", i},
                       {"translation", {0.1 * k, 1.7 * k, 3.3 * k * k}},
                       {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    }
    return MustLoad(builder).scene;
  };
  const Scene a = build(false), b = build(true);
  EXPECT_EQ(SceneDigest(a), SceneDigest(b));
  EXPECT_EQ(a.origin_ws, b.origin_ws);
}

}  // namespace
}  // namespace bakewell
