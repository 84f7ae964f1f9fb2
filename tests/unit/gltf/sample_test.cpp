#include <gtest/gtest.h>

#include <filesystem>

#include "client/gltf/level.h"

namespace bakewell {
namespace {

const char* const kSample = BAKEWELL_SOURCE_DIR "/tests/scenes/sample.glb";

TEST(SampleLevel, IsSmallCleanAndWithoutLightmapCoordinates) {
  EXPECT_LT(std::filesystem::file_size(kSample), 500'000u);
  const auto level = LoadLevel(kSample);
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_TRUE(level->warnings.empty()) << level->warnings.front();
  for (const Object& object : level->scene.objects) EXPECT_TRUE(object.uv1.empty()) << object.name;
  EXPECT_EQ(level->scene.lights.size(), 1u);
  EXPECT_EQ(level->scene.textures.size(), 1u);
  EXPECT_EQ(level->scene.environment.type, EnvironmentType::kGradient);
}

TEST(SampleLevel, EverySolidLooksOutwards) {
  const auto level = LoadLevel(kSample);
  ASSERT_TRUE(level.ok()) << level.status();
  for (const Object& object : level->scene.objects) {
    double volume_m3 = 0;
    for (size_t t = 0; t < object.index.size(); t += 3) {
      const Vec3d a = ToDouble(object.position[object.index[t]]), b = ToDouble(object.position[object.index[t + 1]]);
      volume_m3 += Dot(a, Cross(b, ToDouble(object.position[object.index[t + 2]]))) / 6;
    }
    // The carved screen is two faces of a board; all else is closed.
    if (level->scene.materials[object.material].alpha_mode != AlphaMode::kMask) {
      EXPECT_GT(volume_m3, 0) << object.name;
    }
  }
}

}  // namespace
}  // namespace bakewell
