#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>

#include "client/gltf/level.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// A file with something of everything, so that truncations and flips meet every reader.
GltfBuilder RichGltf() {
  GltfBuilder builder = QuadGltf();
  const int texture = builder.AddTexture(EncodePng(2, 2, std::vector<uint8_t>(16, 200)));
  builder.AddMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}},
                       {"emissiveFactor", {1, 1, 1}},
                       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 10}}}}}});
  builder.json["meshes"][0]["primitives"][0]["material"] = 0;
  const int translation = builder.AddVec3({{1, 0, 0}, {2, 0, 0}});
  builder.AddNode(
      {{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", translation}}}}}}}});
  builder.AddLight({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}}}});
  builder.AddNode({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}, {"rotation", {0, 0, 0, 1}}});
  builder.json["scenes"][0]["extras"] = {{"environment", {{"type", "constant"}, {"radiance", {1, 1, 1}}}},
                                         {"lightmap", {{"width", 64}, {"height", 64}}}};
  return builder;
}

absl::Status LoadBytes(const std::string& bytes, const TempDir& folder, const char* name = "hostile.glb") {
  std::ofstream(folder / name, std::ios::binary) << bytes;
  return LoadLevel(folder / name).status();
}

// Keyed, so that a failure can be repeated (SplitMix64).
uint64_t Random(uint64_t key) {
  key += 0x9E3779B97F4A7C15u;
  key = (key ^ (key >> 30)) * 0xBF58476D1CE4E5B9u;
  key = (key ^ (key >> 27)) * 0x94D049BB133111EBu;
  return key ^ (key >> 31);
}

TEST(HostileLevel, RichFileIsFineBeforeItIsBroken) {
  const TempDir folder;
  EXPECT_TRUE(LoadBytes(RichGltf().Glb(), folder).ok());
  EXPECT_TRUE(LoadBytes(RichGltf().Gltf(), folder, "hostile.gltf").ok());
}

TEST(HostileLevel, EveryPrefixIsRefused) {
  const TempDir folder;
  const std::string glb = RichGltf().Glb();
  for (size_t size = 0; size < glb.size(); ++size) {
    const absl::Status status = LoadBytes(glb.substr(0, size), folder);
    ASSERT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << size << " of " << glb.size();
    ASSERT_THAT(std::string(status.message()), HasSubstr("hostile.glb")) << size;
  }
}

TEST(HostileLevel, ByteFlipsNeverCrash) {
  const TempDir folder;
  const std::string glb = RichGltf().Glb();
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  int tried = 0;
  for (uint64_t round = 0; round < 3000 && std::chrono::steady_clock::now() < deadline; ++round, ++tried) {
    std::string bytes = glb;
    const uint64_t flips = 1 + Random(round) % 4;
    for (uint64_t i = 0; i < flips; ++i) {
      bytes[Random(round * 16 + i) % bytes.size()] = static_cast<char>(Random(round * 16 + 8 + i));
    }
    const absl::Status status = LoadBytes(bytes, folder);
    ASSERT_TRUE(status.ok() || status.code() == absl::StatusCode::kInvalidArgument) << round << ": " << status;
  }
  EXPECT_GT(tried, 500);
}

struct Attack {
  const char* name;
  std::function<void(GltfBuilder&)> apply;
  const char* message;  // what the one error must say
};

json& Primitive(GltfBuilder& b) { return b.json["meshes"][0]["primitives"][0]; }

// One material of this JSON, used by the quad.
void UseMaterial(GltfBuilder& b, const json& material) { Primitive(b)["material"] = b.AddMaterial(material); }

void UseImage(GltfBuilder& b, const json& image) {
  b.json["images"] = json::array({image});
  b.json["textures"] = {{{"source", 0}}};
  UseMaterial(b, {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
}

void UseLight(GltfBuilder& b, const json& light) {
  const int index = b.AddLight(light);
  b.AddNode({{"name", "lamp"}, {"extensions", {{"KHR_lights_punctual", {{"light", index}}}}}});
}

// The header of a PNG that announces 60000 x 60000 pixels.
std::string BombPng() {
  std::string png = EncodePng(1, 1, {1, 2, 3, 4});
  const std::string side("\0\0\xEA\x60", 4);
  return png.replace(16, 8, side + side);
}

const Attack kAttacks[] = {
    {"no asset", [](GltfBuilder& b) { b.json.erase("asset"); }, "asset is missing"},
    {"glTF 1", [](GltfBuilder& b) { b.json["asset"]["version"] = "1.0"; }, "asset: version \"1.0\""},
    {"required extension", [](GltfBuilder& b) { b.json["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
     "KHR_draco_mesh_compression is not supported"},
    {"scene index", [](GltfBuilder& b) { b.json["scene"] = 7; }, "scene: 7 is not an index into scenes"},
    {"negative index", [](GltfBuilder& b) { b.json["nodes"][0]["mesh"] = -1; }, "nodes[0] \"quad\": mesh: -1 is not"},
    {"huge index", [](GltfBuilder& b) { b.json["nodes"][0]["mesh"] = uint64_t{1} << 32; }, "4294967296 is not"},
    {"fractional index", [](GltfBuilder& b) { b.json["nodes"][0]["mesh"] = 0.5; }, "mesh: 0.5 is not an index"},
    {"cycle", [](GltfBuilder& b) { b.json["nodes"][0]["children"] = {0}; }, "nodes[0] \"quad\": is reached twice"},
    {"shared child",
     [](GltfBuilder& b) {
       b.AddNode({{"children", {0}}});
     },
     "is reached twice"},
    {"short matrix",
     [](GltfBuilder& b) {
       b.json["nodes"][0]["matrix"] = {1, 2, 3};
     },
     "matrix: has 3 elements, 16"},
    {"projective matrix",
     [](GltfBuilder& b) { b.json["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "last row of its matrix"},
    {"zero quaternion",
     [](GltfBuilder& b) {
       b.json["nodes"][0]["rotation"] = {0, 0, 0, 0};
     },
     "not a quaternion"},
    {"infinite scale",
     [](GltfBuilder& b) {
       b.json["nodes"][0]["scale"] = {1e300, 1, 1};
     },
     "scale[0]"},
    {"vertex count overflow", [](GltfBuilder& b) { b.json["accessors"][0]["count"] = uint64_t{1} << 62; },
     "accessors[0]: count"},
    {"vertex count beyond view",
     [](GltfBuilder& b) {
       for (int i = 0; i < 4; ++i) b.json["accessors"][i]["count"] = 5;
     },
     "leave its 48-byte buffer view"},
    {"offset beyond view", [](GltfBuilder& b) { b.json["accessors"][0]["byteOffset"] = uint64_t{1} << 52; },
     "leave its 48-byte buffer view"},
    {"view beyond buffer", [](GltfBuilder& b) { b.json["bufferViews"][0]["byteLength"] = 1 << 30; },
     "bufferViews[0]: bytes [0, 1073741824) leave its buffer"},
    {"view offset", [](GltfBuilder& b) { b.json["bufferViews"][0]["byteOffset"] = (uint64_t{1} << 53); },
     "leave its buffer"},
    {"stride", [](GltfBuilder& b) { b.json["bufferViews"][0]["byteStride"] = 4; }, "stride 4 is less than an element"},
    {"odd stride", [](GltfBuilder& b) { b.json["bufferViews"][0]["byteStride"] = 13; }, "byteStride"},
    {"buffer length", [](GltfBuilder& b) { b.json["buffers"][0]["byteLength"] = uint64_t{1} << 40; },
     "buffers[0]: byteLength is 1099511627776"},
    {"component type", [](GltfBuilder& b) { b.json["accessors"][0]["componentType"] = 5124; }, "5124 does not exist"},
    {"element type", [](GltfBuilder& b) { b.json["accessors"][0]["type"] = "VEC2"; }, "has 2 components, 3"},
    {"count mismatch", [](GltfBuilder& b) { b.json["accessors"][1]["count"] = 3; }, "NORMAL has 3 elements"},
    {"gigabytes of zeros",
     [](GltfBuilder& b) {
       for (int i = 0; i < 4; ++i) b.json["accessors"][i]["count"] = uint64_t{1} << 28;
       b.json["accessors"][0].erase("bufferView");
     },
     "vertices in 1 instances, at most"},
    {"megabytes of zeros",
     [](GltfBuilder& b) {
       for (int i = 0; i < 4; ++i) b.json["accessors"][i]["count"] = uint64_t{1} << 21;
       b.json["accessors"][0].erase("bufferView");
     },
     "accessors[0]: 2097152 elements without a buffer view"},
    {"index beyond vertices",
     [](GltfBuilder& b) {
       Primitive(b)["indices"] = b.AddIndices({0, 1, 9});
     },
     "index 9 at place 2 is beyond the 4 vertices"},
    {"float indices", [](GltfBuilder& b) { Primitive(b)["indices"] = 2; }, "indices are not unsigned integers"},
    {"four indices",
     [](GltfBuilder& b) {
       Primitive(b)["indices"] = b.AddIndices({0, 1, 2, 3});
     },
     "4 indices do not make triangles"},
    {"no position", [](GltfBuilder& b) { Primitive(b)["attributes"].erase("POSITION"); }, "has no POSITION"},
    {"negative accessor", [](GltfBuilder& b) { Primitive(b)["attributes"]["POSITION"] = -1; }, "POSITION: -1 is not"},
    {"sparse index",
     [](GltfBuilder& b) {
       const std::array<uint32_t, 1> where = {77};
       const std::array<float, 3> what = {};
       b.json["accessors"][0]["sparse"] = {
           {"count", 1},
           {"indices", {{"bufferView", b.AddView(std::as_bytes(std::span(where)))}, {"componentType", 5125}}},
           {"values", {{"bufferView", b.AddView(std::as_bytes(std::span(what)))}}}};
     },
     "sparse index 77"},
    {"sparse count",
     [](GltfBuilder& b) {
       b.json["accessors"][0]["sparse"] = {{"count", 2000000000},
                                           {"indices", {{"bufferView", 0}, {"componentType", 5125}}},
                                           {"values", {{"bufferView", 0}}}};
     },
     "2000000000 sparse elements in 4"},
    {"billion triangles",
     [](GltfBuilder& b) {
       std::vector<Vec3f> where(20000, Vec3f{});
       const int translation = b.AddVec3(where);
       Primitive(b)["indices"] = b.AddIndices(std::vector<uint32_t>(30000, 0));
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", translation}};
     },
     "with it the scene has 2e+08 triangles"},
    {"instances differ",
     [](GltfBuilder& b) {
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
           {"TRANSLATION", b.AddVec3({{0, 0, 0}})}, {"SCALE", b.AddVec3({{1, 1, 1}, {1, 1, 1}})}};
     },
     "differ in length"},
    {"instance nan",
     [](GltfBuilder& b) {
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
           {"TRANSLATION", b.AddVec3({{std::nanf(""), 0, 0}})}};
     },
     "TRANSLATION of an instance is not finite"},
    {"negative emission",
     [](GltfBuilder& b) {
       UseMaterial(b, {{"name", "m"}, {"emissiveFactor", {-1, 0, 0}}});
     },
     "materials[0] \"m\": its emission is negative"},
    {"blinding emission",
     [](GltfBuilder& b) {
       UseMaterial(b, {{"name", "m"},
                       {"emissiveFactor", {1, 0, 0}},
                       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3e19}}}}}});
     },
     "materials[0] \"m\": its emission, 3e+19, is above 1e+15"},
    {"huge emission",
     [](GltfBuilder& b) {
       UseMaterial(b, {{"emissiveFactor", {1e30, 0, 0}},
                       {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 1e30}}}}}});
     },
     "its emission is not finite"},
    {"alpha mode",
     [](GltfBuilder& b) {
       UseMaterial(b, {{"alphaMode", "GLOW"}});
     },
     "alphaMode \"GLOW\""},
    {"colour of two",
     [](GltfBuilder& b) {
       UseMaterial(b, {{"emissiveFactor", {1, 2}}});
     },
     "has 2 elements, 3"},
    {"negative light",
     [](GltfBuilder& b) {
       UseLight(b, {{"type", "point"}, {"intensity", -1}, {"name", "x"}});
     },
     "lights[0] \"x\": its colour times intensity is negative"},
    {"blinding light",
     [](GltfBuilder& b) {
       UseLight(b, {{"type", "point"}, {"intensity", 3e19}, {"name", "x"}});
     },
     "lights[0] \"x\": its colour times intensity, 3e+19, is above 1e+15"},
    {"light type",
     [](GltfBuilder& b) {
       UseLight(b, {{"type", "tube"}});
     },
     "type \"tube\" does not exist"},
    {"light cone",
     [](GltfBuilder& b) {
       UseLight(b, {{"type", "spot"}, {"spot", {{"innerConeAngle", 1}, {"outerConeAngle", 0.5}}}});
     },
     "cone angles"},
    {"light without direction",
     [](GltfBuilder& b) {
       UseLight(b, {{"type", "directional"}});
       b.json["nodes"][1]["scale"] = {0, 0, 0};
     },
     "no direction"},
    {"environment type",
     [](GltfBuilder& b) {
       b.json["scenes"][0]["extras"]["environment"] = {{"type", "fog"}};
     },
     "type \"fog\""},
    {"environment negative",
     [](GltfBuilder& b) {
       b.json["scenes"][0]["extras"]["environment"] = {{"type", "constant"}, {"radiance", {0, -1, 0}}};
     },
     "radiance is negative"},
    {"environment blinding",
     [](GltfBuilder& b) {
       b.json["scenes"][0]["extras"]["environment"] = {{"type", "constant"}, {"radiance", {0, 1e16, 0}}};
     },
     "radiance, 1e+16, is above 1e+15"},
    {"page",
     [](GltfBuilder& b) {
       b.json["scenes"][0]["extras"]["lightmap"] = {{"width", 0}, {"height", 1}};
     },
     "0 x 1 texels"},
    {"density", [](GltfBuilder& b) { b.json["nodes"][0]["extras"]["lightmapDensity"] = 0; }, "lightmapDensity"},
    {"absolute uri",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "/etc/passwd"}});
     },
     "leaves the file's folder"},
    {"uri upwards",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "a/../../secret.png"}});
     },
     "leaves the file's folder"},
    {"escaped uri upwards",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "%2e%2e/secret.png"}});
     },
     "leaves the file's"},
    {"uri scheme",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "http://x/y.png"}});
     },
     "leaves the file's folder"},
    {"bad escape",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "a%2"}});
     },
     "malformed % escape"},
    {"bad base64",
     [](GltfBuilder& b) {
       UseImage(b, {{"uri", "data:image/png;base64,%%%"}});
     },
     "base64 is malformed"},
    {"not an image",
     [](GltfBuilder& b) {
       UseImage(b, {{"bufferView", 0}});
     },
     "images[0]: it is neither PNG nor JPEG"},
    {"broken image",
     [](GltfBuilder& b) {
       const std::string png = EncodePng(2, 2, std::vector<uint8_t>(16)).substr(0, 45);
       UseImage(b, {{"bufferView", b.AddView(std::as_bytes(std::span(png)))}});
     },
     "images[0]: it cannot be decoded"},
    {"image bomb",
     [](GltfBuilder& b) {
       const std::string png = BombPng();
       UseImage(b, {{"bufferView", b.AddView(std::as_bytes(std::span(png)))}});
     },
     "60000 x 60000 pixels"},
    {"image of nothing", [](GltfBuilder& b) { UseImage(b, json::object()); }, "neither a uri nor a bufferView"},
};

TEST(HostileLevel, EachAttackGivesOneErrorThatNamesFileAndObject) {
  const TempDir folder;
  for (const Attack& attack : kAttacks) {
    GltfBuilder builder = QuadGltf();
    attack.apply(builder);
    const absl::Status status = LoadBytes(builder.Glb(), folder);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << attack.name << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(attack.message)) << attack.name;
    EXPECT_THAT(std::string(status.message()), HasSubstr("hostile.glb: ")) << attack.name;
  }
}

TEST(HostileLevel, MissingFilesAreNotFound) {
  const TempDir folder;
  const absl::Status level = LoadLevel(folder / "nothing.glb").status();
  EXPECT_EQ(level.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(level.message()), HasSubstr("nothing.glb"));
  GltfBuilder builder = QuadGltf();
  builder.json["buffers"][0]["uri"] = "missing.bin";
  const absl::Status buffer = LoadBytes(builder.Glb(), folder);
  EXPECT_EQ(buffer.code(), absl::StatusCode::kNotFound) << buffer;
  EXPECT_THAT(std::string(buffer.message()), HasSubstr("buffers[0]"));
}

TEST(HostileLevel, LinksOutOfTheFolderAreNotFollowed) {
  const TempDir folder, elsewhere;
  std::ofstream(elsewhere / "secret.png") << "secret";
  std::filesystem::create_symlink(elsewhere / "secret.png", folder / "link.png");
  GltfBuilder builder = QuadGltf();
  UseImage(builder, {{"uri", "link.png"}});
  EXPECT_THAT(std::string(LoadBytes(builder.Glb(), folder).message()), HasSubstr("leaves the file's folder"));
}

TEST(HostileLevel, DeepNestingCostsNoStack) {
  const TempDir folder;
  const std::string deep(1000000, '[');
  EXPECT_THAT(std::string(LoadBytes(deep, folder, "deep.gltf").message()), HasSubstr("nested deeper than"));
  // A chain of nodes is no nesting of JSON, and is fine.
  GltfBuilder chain = QuadGltf();
  for (int i = 1; i < 20000; ++i) chain.json["nodes"].push_back({{"children", {i - 1}}});
  chain.json["scenes"][0]["nodes"] = {19999};
  EXPECT_TRUE(LoadBytes(chain.Glb(), folder).ok());
}

TEST(HostileLevel, GlbHeaderIsChecked) {
  const TempDir folder;
  std::string glb = QuadGltf().Glb();
  glb[4] = 1;
  EXPECT_THAT(std::string(LoadBytes(glb, folder).message()), HasSubstr("version 1 is not 2"));
  glb = QuadGltf().Glb();
  glb[15] = '\x7F';
  EXPECT_THAT(std::string(LoadBytes(glb, folder).message()), HasSubstr("is announced"));
}

}  // namespace
}  // namespace bakewell
