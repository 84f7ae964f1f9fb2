#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "client/gltf/level.h"

namespace bakewell {
namespace {

// The scenes of shared/reference beside the checkout and their counts, written by another program.
class ReferenceScene : public testing::TestWithParam<const char*> {};

TEST_P(ReferenceScene, HasTheCountsOfItsJson) {
  const std::string stem = std::string(BAKEWELL_REFERENCE_DIR) + "/scenes/" + GetParam();
  std::ifstream file(stem + ".json");
  ASSERT_TRUE(file) << stem << ".json is missing";
  const auto counts = nlohmann::json::parse(file);
  const auto level = LoadLevel(stem + ".glb");
  ASSERT_TRUE(level.ok()) << level.status();

  int64_t lightmapped = 0, occluding = 0, emissive = 0;
  double area_m2 = 0;
  for (const Object& object : level->scene.objects) {
    const auto triangles = static_cast<int64_t>(object.index.size() / 3);
    (object.lightmapped ? lightmapped : occluding) += triangles;
    emissive += level->scene.materials[object.material].emission == Rgb{} ? 0 : triangles;
    for (size_t i = 0; i < object.index.size() && object.lightmapped; i += 3) {
      const Vec3f a = object.position[object.index[i]];
      area_m2 +=
          0.5 * Length(Cross(object.position[object.index[i + 1]] - a, object.position[object.index[i + 2]] - a));
    }
  }
  EXPECT_EQ(lightmapped, counts["tris"]);
  EXPECT_EQ(occluding, counts["occ_tris"]);
  EXPECT_EQ(emissive, counts["emissive_tris"]);
  EXPECT_EQ(static_cast<int64_t>(level->scene.lights.size()), counts["lights"]);
  // Positions are single precision.
  EXPECT_NEAR(area_m2, counts["area_m2"].get<double>(), 1e-5 * area_m2);
  ASSERT_TRUE(level->scene.lightmap_page.has_value());
  EXPECT_TRUE(level->warnings.empty()) << level->warnings.front();
}

INSTANTIATE_TEST_SUITE_P(Shared, ReferenceScene, testing::Values("cornell", "office", "manylights"));

}  // namespace
}  // namespace bakewell
