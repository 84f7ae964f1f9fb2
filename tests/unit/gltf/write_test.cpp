#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <set>

#include "client/gltf/level.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using nlohmann::json;

// The JSON of a .glb.
json JsonOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  uint32_t size = 0;
  std::memcpy(&size, bytes.data() + 12, sizeof(size));
  return json::parse(bytes.substr(20, size));
}

// A layout that splits every vertex: triangle k of the scene gets a chart of its own, in a row; pages are used in turn.
AtlasLayout OneChartPerTriangle(const Scene& scene, int pages) {
  AtlasLayout layout;
  layout.pages.assign(static_cast<size_t>(pages), PageSize{128, 64});
  for (size_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    ObjectCharts charts;
    for (size_t t = 0; object.lightmapped && t < object.index.size() / 3; ++t) {
      const auto chart = static_cast<int32_t>(layout.charts.size());
      const bool collapsed = object.index[3 * t] == object.index[3 * t + 1];
      charts.chart_of_triangle.push_back(collapsed ? kNoChart : chart);
      layout.charts.push_back({chart % pages, static_cast<int>(o)});
      const auto first = static_cast<uint32_t>(charts.xref.size());
      for (uint32_t k = 0; k < 3; ++k) {
        charts.xref.push_back(object.index[3 * t + k]);
        charts.uv.push_back({static_cast<float>(4 * chart) + static_cast<float>(k), static_cast<float>(k)});
        charts.index.push_back(first + (collapsed ? 0 : k));
      }
    }
    layout.objects.push_back(std::move(charts));
  }
  return layout;
}

// The world-space triangles of a scene as sorted lists of their corners' numbers, bad ones left out. Front is part of
// it.
std::vector<std::array<float, 9>> Triangles(const Scene& scene) {
  std::vector<std::array<float, 9>> all;
  for (const Object& object : scene.objects) {
    for (size_t t = 0; t < object.index.size(); t += 3) {
      if (object.index[t] == object.index[t + 1]) continue;
      std::array<std::array<float, 9>, 3> turns;
      for (size_t i = 0; i < 27; ++i) {
        const Vec3f p = object.position[object.index[t + (i / 9 + i / 3) % 3]];
        turns[i / 9][i % 9] = p[static_cast<int>(i % 3)] + static_cast<float>(scene.origin_ws[static_cast<int>(i % 3)]);
      }
      all.push_back(*std::min_element(turns.begin(), turns.end()));
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

struct Written {
  LoadedLevel before, after;
  json document;
};

Written WriteAndReload(const GltfBuilder& builder, int pages, const char* name = "in.glb") {
  const TempDir folder;
  const auto path = builder.Write(folder / name);
  auto before = LoadLevel(path);
  EXPECT_TRUE(before.ok()) << before.status();
  const AtlasLayout layout = OneChartPerTriangle(before->scene, pages);
  std::vector<LightmapFiles> files;
  for (int page = 0; page < pages; ++page) {
    const std::string stem = "lightmap-" + std::to_string(page);
    files.push_back({stem + ".irradiance.exr", stem + ".sh.exr", ""});
  }
  const absl::Status status = WriteLevel(path, *before, layout, files, folder / "out.glb");
  EXPECT_TRUE(status.ok()) << status;
  auto after = LoadLevel(folder / "out.glb");
  EXPECT_TRUE(after.ok()) << after.status();
  return {*std::move(before), *std::move(after), JsonOf(folder / "out.glb")};
}

// Integers below 2^24 keep every sum of positions and origin exact, so that geometry can be compared bit by bit.
void ExpectSameGeometry(const Written& written) {
  EXPECT_EQ(Triangles(written.before.scene), Triangles(written.after.scene));
  for (const Object& object : written.after.scene.objects) {
    EXPECT_EQ(object.uv1.size(), object.lightmapped ? object.position.size() : 0u);
  }
}

GltfBuilder BigQuad() {
  GltfBuilder builder = QuadGltf();
  auto& attributes = builder.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["POSITION"] = builder.AddVec3({{0, 0, 0}, {8, 0, 0}, {8, 8, 0}, {0, 8, 0}});
  attributes.erase("TEXCOORD_1");
  return builder;
}

TEST(WriteLevel, RoundTripKeepsGeometryAndSetsTheUvs) {
  const Written written = WriteAndReload(BigQuad(), 1);
  ExpectSameGeometry(written);
  const Object& quad = written.after.scene.objects.at(0);
  ASSERT_EQ(quad.uv1.size(), 6u);
  EXPECT_EQ(quad.uv1[quad.index[0]], (Vec2f{0, 0}));
  EXPECT_EQ(quad.uv1[quad.index[2]], (Vec2f{2.0f / 128, 2.0f / 64}));
  EXPECT_EQ(quad.uv1[quad.index[3]], (Vec2f{4.0f / 128, 0}));
  EXPECT_EQ(quad.uv0[quad.index[2]], (Vec2f{1, 1}));
  EXPECT_EQ(
      written.document["nodes"][0]["extras"]["lightmap"],
      json({{"page", 0}, {"texCoord", 1}, {"irradiance", "lightmap-0.irradiance.exr"}, {"sh", "lightmap-0.sh.exr"}}));
  EXPECT_TRUE(written.after.warnings.empty());
}

TEST(WriteLevel, MirroredAndFlatGeometryComesBack) {
  GltfBuilder builder = BigQuad();
  builder.json["meshes"][0]["primitives"][0]["attributes"].erase("NORMAL");
  builder.json["nodes"][0]["scale"] = {-1, 2, 1};
  ExpectSameGeometry(WriteAndReload(builder, 1));
}

TEST(WriteLevel, EveryInstanceGetsAMeshOfItsOwn) {
  GltfBuilder builder = BigQuad();
  builder.AddNode({{"name", "twin"}, {"mesh", 0}, {"translation", {0, 0, 16}}});
  const int translation = builder.AddVec3({{16, 0, 0}, {32, 0, 0}});
  builder.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", translation}};
  const Written written = WriteAndReload(builder, 1);
  ExpectSameGeometry(written);
  EXPECT_EQ(written.after.scene.objects.size(), 3u);
  EXPECT_FALSE(written.document.contains("extensionsUsed"));
  EXPECT_EQ(written.document["nodes"][0]["children"].size(), 2u);
  // Three times the same vertices of the source: one POSITION accessor.
  std::set<int> positions;
  for (size_t i = 1; i < written.document["meshes"].size(); ++i) {
    positions.insert(written.document["meshes"][i]["primitives"][0]["attributes"]["POSITION"].get<int>());
  }
  EXPECT_EQ(positions.size(), 1u);
}

TEST(WriteLevel, SeveralPagesSplitThePrimitive) {
  const Written written = WriteAndReload(BigQuad(), 2);
  ExpectSameGeometry(written);
  const json& mesh = written.document["meshes"][written.document["nodes"][0]["mesh"].get<size_t>()];
  ASSERT_EQ(mesh["primitives"].size(), 2u);
  EXPECT_EQ(mesh["primitives"][0]["extras"]["lightmap"]["page"], 0);
  EXPECT_EQ(mesh["primitives"][1]["extras"]["lightmap"]["page"], 1);
}

TEST(WriteLevel, WhatItDoesNotKnowItKeeps) {
  GltfBuilder builder = BigQuad();
  builder.json["animations"] = {{{"name", "door"}, {"channels", json::array()}, {"samplers", json::array()}}};
  builder.json["extras"] = {{"author", "somebody"}, {"big", uint64_t{1} << 40}};
  builder.json["nodes"][0]["extras"] = {{"quest", {1, 2, 3}}};
  builder.AddMaterial({{"name", "paint"}, {"extensions", {{"X_thing", {{"a", 1}}}}}});
  builder.json["meshes"][0]["primitives"][0]["material"] = 0;
  const std::vector<uint8_t> colors(16, 77);
  builder.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      builder.AddAccessor(std::as_bytes(std::span(colors)), 5121, "VEC4", 4);
  builder.json["accessors"].back()["normalized"] = true;
  builder.json["nodes"].push_back({{"name", "static"}, {"mesh", 0}, {"extras", {{"lightmapped", false}}}});
  builder.json["scenes"][0]["nodes"].push_back(1);
  const Written written = WriteAndReload(builder, 1);
  const json& out = written.document;
  EXPECT_EQ(out["animations"], builder.json["animations"]);
  EXPECT_EQ(out["extras"], builder.json["extras"]);
  EXPECT_EQ(out["materials"], builder.json["materials"]);
  EXPECT_EQ(out["nodes"][0]["extras"]["quest"], json({1, 2, 3}));
  EXPECT_EQ(out["nodes"][1], builder.json["nodes"][1]);
  const json& primitive = out["meshes"][out["nodes"][0]["mesh"].get<size_t>()]["primitives"][0];
  const json& color = out["accessors"][primitive["attributes"]["COLOR_0"].get<size_t>()];
  EXPECT_EQ(color["componentType"], 5121);
  EXPECT_EQ(color["normalized"], true);
  EXPECT_EQ(color["max"], json({77, 77, 77, 77}));
}

TEST(WriteLevel, ExternalFilesAreEmbedded) {
  const TempDir folder;
  GltfBuilder builder = BigQuad();
  builder.json["images"] = {{{"uri", "a%20b.png"}}};
  builder.json["textures"] = {{{"source", 0}}};
  builder.AddMaterial({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  builder.json["meshes"][0]["primitives"][0]["material"] = 0;
  std::ofstream(folder / "a b.png", std::ios::binary) << EncodePng(1, 1, {9, 8, 7, 6});
  const auto path = builder.Write(folder / "in.gltf");
  const auto before = LoadLevel(path);
  ASSERT_TRUE(before.ok()) << before.status();
  const AtlasLayout layout = OneChartPerTriangle(before->scene, 1);
  std::filesystem::create_directory(folder / "out");
  ASSERT_TRUE(WriteLevel(path, *before, layout, std::vector<LightmapFiles>(1), folder / "out" / "scene.glb").ok());
  const auto after = LoadLevel(folder / "out" / "scene.glb");
  ASSERT_TRUE(after.ok()) << after.status();
  EXPECT_EQ(after->scene.textures.at(0).rgba, before->scene.textures.at(0).rgba);
}

TEST(WriteLevel, BadTrianglesAreLeftOut) {
  GltfBuilder builder = BigQuad();
  builder.json["meshes"][0]["primitives"][0]["indices"] = builder.AddIndices({0, 1, 2, 0, 1, 1, 0, 2, 3});
  const Written written = WriteAndReload(builder, 1);
  ExpectSameGeometry(written);
  EXPECT_EQ(written.after.scene.objects[0].index.size(), 6u);
  EXPECT_TRUE(written.after.warnings.empty());
}

TEST(WriteLevel, SceneWithoutChartsIsStillWritten) {
  GltfBuilder builder = BigQuad();
  builder.json["nodes"][0]["extras"]["lightmapped"] = false;
  ExpectSameGeometry(WriteAndReload(builder, 1));
}

TEST(WriteLevel, ChangedInputIsNoticed) {
  const TempDir folder;
  const auto path = BigQuad().Write(folder / "in.glb");
  const auto level = LoadLevel(path);
  ASSERT_TRUE(level.ok());
  const AtlasLayout layout = OneChartPerTriangle(level->scene, 1);
  QuadGltf().Write(path);
  const absl::Status status = WriteLevel(path, *level, layout, std::vector<LightmapFiles>(1), folder / "out.glb");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_FALSE(std::filesystem::exists(folder / "out.glb"));
}

}  // namespace
}  // namespace bakewell
