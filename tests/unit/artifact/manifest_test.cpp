#include "core/artifact/manifest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/artifact/atomic_file.h"
#include "core/artifact/json_line.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using Json = nlohmann::json;

TEST(Manifest, SaysWhatItWasGiven) {
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "abc", "abc").ok());
  Manifest manifest;
  manifest.version = "0.1.0";
  manifest.scene_file = "office.glb";
  manifest.settings_json = R"({"quality":"HIGH"})";
  manifest.counters = {{"gather/rays", 7}, {"skip/no_light/enabled", 1}, {"skip/no_light/of", 3}};
  manifest.warnings = {"no normals"};
  manifest.files = {DescribeFile(folder / "abc", "irradiance").value()};
  ASSERT_TRUE(WriteManifest(folder.path(), manifest).ok());

  const Json json = Json::parse(ReadWholeFile(folder / "manifest.json").value());
  EXPECT_EQ(json["format"], 2);
  EXPECT_EQ(json["settings"]["quality"], "HIGH");
  EXPECT_EQ(json["statistics"]["counters"]["gather/rays"], 7);
  EXPECT_EQ(json["statistics"]["counters"].size(), 1u);
  EXPECT_EQ(json["statistics"]["skip"]["no_light"]["enabled"], true);
  EXPECT_EQ(json["statistics"]["skip"]["no_light"]["of"], 3);
  EXPECT_EQ(json["warnings"][0], "no normals");
  EXPECT_EQ(json["files"][0]["name"], "abc");
  EXPECT_EQ(json["files"][0]["size_bytes"], 3);
  EXPECT_EQ(json["files"][0]["sha256"], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Manifest, EmptyListsAreListsAndNanIsNull) {
  Manifest manifest;
  manifest.estimated_error = std::nan("");
  const Json json = Json::parse(ManifestJson(manifest).value());
  EXPECT_EQ(json["files"], Json::array());
  EXPECT_EQ(json["statistics"]["counters"], Json::object());
  EXPECT_TRUE(json["statistics"]["estimated_error"].is_null());
}

TEST(Manifest, SettingsThatAreNoObjectAreRefused) {
  Manifest manifest;
  manifest.settings_json = "[1";
  EXPECT_EQ(ManifestJson(manifest).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(JsonLine, MembersKeepTheirOrderAndTextIsEscaped) {
  const std::string text = JsonLine()
                               .Add("z", "a\"\n\xff")
                               .Add("a", int64_t{-3})
                               .Add("n", std::nan(""))
                               .Add("list", std::vector<std::string>{"x"})
                               .Add("objects", std::vector<JsonLine>{JsonLine().Add("d", 0.5)})
                               .Text();
  EXPECT_EQ(text, "{\"z\":\"a\\\"\\n\xEF\xBF\xBD\",\"a\":-3,\"n\":null,\"list\":[\"x\"],\"objects\":[{\"d\":0.5}]}");
}

}  // namespace
}  // namespace bakewell
