#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "client/gltf/level.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using nlohmann::json;
using testing::HasSubstr;

struct Attack {
  const char* name;
  std::function<void(GltfBuilder&)> apply;
  const char* message;  // what the one error must say
};

json& Primitive(GltfBuilder& b) { return b.json["meshes"][0]["primitives"][0]; }

// A few hundred bytes that ask for a thousand million of something.
const Attack kCrowds[] = {
    {"instances of nothing",
     [](GltfBuilder& b) {
       const int where = b.AddVec3({{0, 0, 0}});
       b.json["accessors"][static_cast<size_t>(where)]["count"] = 1'000'000'000;
       b.json["accessors"][static_cast<size_t>(where)].erase("bufferView");
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", where}};
     },
     "with it the scene has 2e+09 triangles"},
    {"instances that lie",
     [](GltfBuilder& b) {
       const int where = b.AddVec3({{0, 0, 0}});
       b.json["accessors"][static_cast<size_t>(where)]["count"] = 1'000'000'000;
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", where}};
     },
     "with it the scene has 2e+09 triangles"},
    {"instances of few vertices and many triangles",
     [](GltfBuilder& b) {
       const int where = b.AddVec3(std::vector<Vec3f>(100'000, Vec3f{}));
       Primitive(b)["indices"] = b.AddIndices(std::vector<uint32_t>(30'000, 0));
       b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", where}};
     },
     "with it the scene has 1e+09 triangles"},
    {"nodes of one mesh",
     [](GltfBuilder& b) {
       Primitive(b)["indices"] = b.AddIndices(std::vector<uint32_t>(300'000, 0));
       json& roots = b.json["scenes"][0]["nodes"];
       for (int i = 0; i < 10'000; ++i) {
         roots.push_back(b.json["nodes"].size());
         b.json["nodes"].push_back({{"mesh", 0}});
       }
     },
     "triangles"},
    {"vertices",
     [](GltfBuilder& b) {
       for (int i = 0; i < 4; ++i) b.json["accessors"][i]["count"] = 4'000'000'000;
     },
     "4e+09 vertices"},
    {"indices",
     [](GltfBuilder& b) {
       const int index = b.AddIndices({0, 1, 2});
       b.json["accessors"][static_cast<size_t>(index)]["count"] = 3'000'000'000;
       Primitive(b)["indices"] = index;
     },
     "1e+09 triangles"},
    {"indices of nothing",
     [](GltfBuilder& b) {
       const int index = b.AddIndices({0, 1, 2});
       b.json["accessors"][static_cast<size_t>(index)]["count"] = 3'000'000'000;
       b.json["accessors"][static_cast<size_t>(index)].erase("bufferView");
       Primitive(b)["indices"] = index;
     },
     "invalid bufferView"},
};

TEST(HostileCrowd, IsRefusedInBoundedMemoryAndTime) {
  const TempDir folder;
  for (const Attack& attack : kCrowds) {
    GltfBuilder builder = QuadGltf();
    attack.apply(builder);
    WriteQuickly(folder / "hostile.glb", builder.Glb());
    const PeakMemory memory;
    const auto start = std::chrono::steady_clock::now();
    const absl::Status status = LoadLevel(folder / "hostile.glb").status();
    const auto took = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << attack.name << ": " << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(attack.message)) << attack.name;
    // What was asked for is 10 GB and more. The file has 2 MB at most, some 12,000 nodes and 100,000 instances.
    EXPECT_LT(memory.GrownMegabytes(), 128) << attack.name;
    EXPECT_LT(took, std::chrono::seconds(5)) << attack.name;
  }
}

}  // namespace
}  // namespace bakewell
