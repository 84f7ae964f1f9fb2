#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "client/local/bake.h"
#include "core/scene/canonical.h"
#include "tests/property/stability/stress.h"
#include "tests/property/studio.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temp_dir.h"

// Numbers that are none, in every field of a scene, a file and the settings: refused with an error that says where, or
// counted and dropped as client/gltf/README.md says. Never in the light.
namespace bakewell {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A scene with something in every field.
Scene FullScene() {
  Scene scene = Studio();
  Texture texture;
  texture.width = texture.height = 2;
  texture.rgba.assign(16, 200);
  scene.textures.push_back(texture);
  scene.materials[0].base_texture.texture = scene.materials[0].emission_texture.texture = 0;
  scene.environment.type = EnvironmentType::kLatLong;
  scene.environment.width = 2;
  scene.environment.height = 1;
  scene.environment.latlong = {{1, 2, 3}, {4, 5, 6}};
  return scene;
}

void AddFloats(std::vector<float*>& fields, std::initializer_list<float*> more) {
  fields.insert(fields.end(), more.begin(), more.end());
}
void AddVector(std::vector<float*>& fields, Vec3f& v) { AddFloats(fields, {&v.x, &v.y, &v.z}); }
void AddVector(std::vector<float*>& fields, Vec2f& v) { AddFloats(fields, {&v.x, &v.y}); }

void AddTextureRef(std::vector<float*>& fields, TextureRef& ref) {
  AddVector(fields, ref.offset);
  AddVector(fields, ref.scale);
  AddFloats(fields, {&ref.rotation_rad});
}

// Every float of a scene; of vertices, one.
std::vector<float*> FieldsOf(Scene& scene) {
  std::vector<float*> fields;
  Material& material = scene.materials[0];
  AddVector(fields, material.base_color);
  AddVector(fields, material.emission);
  AddFloats(fields, {&material.base_alpha, &material.alpha_cutoff});
  AddTextureRef(fields, material.base_texture);
  AddTextureRef(fields, material.emission_texture);
  PunctualLight& light = scene.lights[0];
  for (Vec3f* v : {&light.intensity, &light.position, &light.direction, &light.tangent}) AddVector(fields, *v);
  AddFloats(fields, {&light.cos_inner, &light.cos_outer, &light.angular_diameter_rad});
  Environment& sky = scene.environment;
  for (Rgb* v : {&sky.radiance, &sky.zenith, &sky.horizon, &sky.ground, &sky.latlong[1]}) AddVector(fields, *v);
  Object& object = scene.objects[0];
  AddFloats(fields, {&object.density});
  AddVector(fields, object.position[2]);
  AddVector(fields, object.normal[1]);
  AddVector(fields, object.uv0[3]);
  AddVector(fields, object.uv1[0]);
  return fields;
}

TEST(SceneBytes, WithANumberThatIsNoneInAnyFieldAreRefused) {
  Scene scene = FullScene();
  ASSERT_TRUE(ParseScene(SerializeScene(scene)).ok());
  const std::vector<float*> fields = FieldsOf(scene);
  for (size_t i = 0; i < fields.size(); ++i) {
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      const float good = std::exchange(*fields[i], bad);
      const auto parsed = ParseScene(SerializeScene(scene));
      EXPECT_EQ(parsed.status().code(), absl::StatusCode::kDataLoss) << "field " << i << ", " << bad;
      EXPECT_NE(parsed.status().message().find("finite"), std::string::npos) << parsed.status().message();
      *fields[i] = good;
    }
  }
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    const double good = std::exchange(scene.origin_ws.y, bad);
    EXPECT_EQ(ParseScene(SerializeScene(scene)).status().code(), absl::StatusCode::kDataLoss);
    scene.origin_ws.y = good;
  }
}

TEST(Settings, WithASkyBeyondWhatVariancesHoldAreRefused) {
  BakeSettings settings;
  settings.environment = Environment{};
  settings.environment->radiance = {0, 1e15f, 0};
  EXPECT_TRUE(ValidateSettings(settings).ok());
  settings.environment->radiance = {0, 3e19f, 0};
  EXPECT_EQ(ValidateSettings(settings).code(), absl::StatusCode::kInvalidArgument);
}

TEST(Settings, WithANumberThatIsNoneAreRefused) {
  BakeSettings settings;
  settings.environment = Environment{};
  settings.environment->latlong = {{1, 1, 1}};
  settings.environment->width = settings.environment->height = 1;
  ASSERT_TRUE(ValidateSettings(settings).ok());
  Environment& sky = *settings.environment;
  for (float* field : {&settings.texels_per_metre, &settings.footprint, &settings.target_error, &settings.albedo_limit,
                       &sky.radiance.x, &sky.zenith.y, &sky.horizon.z, &sky.ground.x, &sky.latlong[0].y}) {
    for (const float bad : {kNan, kInfinity, -kInfinity}) {
      const float good = std::exchange(*field, bad);
      EXPECT_EQ(ValidateSettings(settings).code(), absl::StatusCode::kInvalidArgument);
      *field = good;
    }
  }
}

// A file with every number that the loader reads.
GltfBuilder FullGltf() {
  GltfBuilder builder = QuadGltf();
  const int texture = builder.AddTexture(EncodePng(2, 2, std::vector<uint8_t>(16, 200)));
  const nlohmann::json transform = {{"offset", {0.1, 0.2}}, {"scale", {1, 2}}, {"rotation", 0.3}};
  const nlohmann::json info = {{"index", texture}, {"extensions", {{"KHR_texture_transform", transform}}}};
  const int material = builder.AddMaterial(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"baseColorTexture", info}}},
       {"emissiveFactor", {0.1, 0.2, 0.3}},
       {"emissiveTexture", info},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.5},
       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 2}}}}}});
  builder.json["meshes"][0]["primitives"][0]["material"] = material;
  builder.json["nodes"][0].update({{"translation", {1, 2, 3}},
                                   {"rotation", {0, 0, 0, 1}},
                                   {"scale", {1, 1, 1}},
                                   {"extras", {{"lightmapDensity", 1}}}});
  const nlohmann::json color = {1, 1, 1};
  builder.AddLight({{"type", "point"}, {"color", color}, {"intensity", 1}});
  builder.AddLight({{"type", "spot"}, {"color", color}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}});
  builder.AddLight({{"type", "directional"}, {"color", color}, {"extras", {{"angularDiameterDeg", 0.5}}}});
  for (int k = 0; k < 3; ++k) {
    builder.AddNode({{"translation", {0, 0, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", k}}}}}});
  }
  builder.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength"};
  builder.json["scenes"][0]["extras"] = {
      {"environment", {{"type", "gradient"}, {"zenith", color}, {"horizon", color}, {"ground", color}}},
      {"lightmap", {{"width", 8}, {"height", 8}}}};
  return builder;
}

absl::StatusOr<LoadedLevel> Load(const GltfBuilder& builder) {
  const TempDir dir;
  return LoadLevel(builder.Write(dir.path() / "full.glb"));
}

// Replaces each number of the document that is no count, index or version by `bad`, one at a time.
template <typename Visit>
void ForEachNumber(const nlohmann::json& document, double bad, Visit visit) {
  const nlohmann::json flat = document.flatten();
  for (const auto& [path, value] : flat.items()) {
    const bool settable = path.starts_with("/materials") || path.starts_with("/nodes") || path.starts_with("/scenes") ||
                          path.starts_with("/extensions/");
    const bool is_index = path.ends_with("/index") || path.ends_with("/mesh") || path.ends_with("/light") ||
                          path.starts_with("/scenes/0/nodes");
    if (!settable || is_index || !value.is_number()) continue;
    nlohmann::json changed = document;
    changed[nlohmann::json::json_pointer(path)] = bad;
    visit(path, changed);
  }
}

TEST(GltfNumbers, BeyondWhatFloatsHoldAreRefusedByName) {
  GltfBuilder builder = FullGltf();
  ASSERT_TRUE(Load(builder).ok()) << Load(builder).status().message();
  const nlohmann::json document = builder.json;
  int seen = 0;
  for (const double bad : {1e39, -1e39, 1e308}) {
    ForEachNumber(document, bad, [&](const std::string& path, const nlohmann::json& changed) {
      ++seen;
      builder.json = changed;
      const auto level = Load(builder);
      EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument) << path;
      // The field, or the array whose element it is.
      const nlohmann::json::json_pointer pointer(path);
      const bool in_array = std::isdigit(pointer.back()[0]) != 0;
      const std::string field =
          in_array ? pointer.parent_pointer().back() + "[" + pointer.back() + "]" : pointer.back();
      const std::string message(level.status().message());
      EXPECT_NE(message.find("full.glb: "), std::string::npos) << message;
      EXPECT_NE(message.find(field), std::string::npos) << field << ": " << message;
    });
  }
  EXPECT_GT(seen, 150);
}

TEST(GltfNumbers, ThatJsonDoesNotHaveAreRefused) {
  const std::string text = FullGltf().Gltf();
  const TempDir dir;
  for (const char* bad : {"NaN", "Infinity", "-Infinity", "1e999"}) {
    std::string changed = text;
    const std::string good = "\"alphaCutoff\":0.5";
    changed.replace(changed.find(good), good.size(), std::string("\"alphaCutoff\":") + bad);
    std::ofstream(dir.path() / "bad.gltf") << changed;
    const auto level = LoadLevel(dir.path() / "bad.gltf");
    EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument) << bad;
    EXPECT_NE(level.status().message().find("bad.gltf"), std::string::npos) << level.status().message();
  }
}

// The quad, of whose accessor `accessor` the first float is `bad`.
absl::StatusOr<LoadedLevel> LoadBroken(int accessor, float bad) {
  GltfBuilder builder = FullGltf();
  const size_t view = builder.json["accessors"][static_cast<size_t>(accessor)]["bufferView"];
  const size_t offset = builder.json["bufferViews"][view]["byteOffset"];
  std::memcpy(builder.bin.data() + offset, &bad, sizeof bad);
  return Load(builder);
}

TEST(GltfVertices, WithNumbersThatAreNoneAreCountedAndDropped) {
  for (const float bad : {kNan, kInfinity, -kInfinity}) {
    // POSITION, NORMAL, TEXCOORD_0, TEXCOORD_1 in QuadGltf's order; the first corner is part of both triangles.
    for (int accessor = 0; accessor < 4; ++accessor) {
      const auto level = LoadBroken(accessor, bad);
      ASSERT_TRUE(level.ok()) << level.status().message();
      ASSERT_EQ(level->geometry.size(), 1u) << accessor;
      const ObjectReport& report = level->geometry[0];
      EXPECT_EQ(report.non_finite, accessor == 0 ? 2 : 0);
      EXPECT_EQ(report.bad_normals, accessor == 1 ? 1 : 0);
      EXPECT_EQ(report.bad_uvs, accessor >= 2 ? 1 : 0);
      EXPECT_FALSE(level->warnings.empty());
      EXPECT_TRUE(ParseScene(SerializeScene(level->scene)).ok());
      if (accessor > 0) BakeStress(level->scene, StressSettings(16, 5000));
    }
  }
}

}  // namespace
}  // namespace bakewell
