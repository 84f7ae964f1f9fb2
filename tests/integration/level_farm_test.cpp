// A real level through planner, charts, photons and gather: the same files from one worker and from three.
#include <gtest/gtest.h>

#include "client/gltf/level.h"
#include "core/scene/canonical.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"
#include "server/plan/level_planner.h"
#include "tests/support/farm.h"
#include "tests/support/level_farm.h"

namespace bakewell::test {
namespace {

v1::Job BakeLevel(const std::string& scene, const BakeSettings& settings, int workers) {
  const LevelFarm farm(workers);
  FarmClient client(farm.Connect());
  const auto submitted = client.Submit(scene, {"", "", ProtoFromSettings(settings).SerializeAsString(), false});
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  return submitted.ok() ? *client.Watch(submitted->job_id(), [](const v1::Job&) { return true; }) : v1::Job();
}

TEST(LevelFarm, FilesAreTheSameForAnyNumberOfWorkers) {
  const auto level = LoadLevel(std::string(BAKEWELL_SOURCE_DIR) + "/tests/scenes/sample.glb");
  ASSERT_TRUE(level.ok()) << level.status();
  const std::vector<std::byte> bytes = SerializeScene(level->scene);
  const std::string scene(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  BakeSettings settings;
  settings.quality = Quality::kPreview;
  settings.resolution = 64;
  const v1::Job one = BakeLevel(scene, settings, 1), three = BakeLevel(scene, settings, 3);
  EXPECT_EQ(one.state(), v1::DONE) << one.reason();
  EXPECT_GE(one.artifacts_size(), 6);
  EXPECT_EQ(DigestsOf(one), DigestsOf(three));
}

TEST(LevelFarm, HostileSettingsAndScenesAreRefusedAtSubmit) {
  const plan::LevelPlanner planner;
  const plan::BlobReader read = [](const Digest&) -> absl::StatusOr<std::string> { return std::string("no scene"); };
  EXPECT_EQ(planner.Plan({{}, "\xff\xff"}, read).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(planner.Plan({{}, ""}, read).status().code(), absl::StatusCode::kInvalidArgument);
  // Field 999, which no version has.
  EXPECT_EQ(plan::ReadSettings("\xb8\x3e\x01").status().code(), absl::StatusCode::kInvalidArgument);
  BakeSettings settings;
  settings.density = DensityMode::kSignal;
  EXPECT_EQ(plan::ReadSettings(ProtoFromSettings(settings).SerializeAsString()).status().code(),
            absl::StatusCode::kInvalidArgument);
  settings.density = DensityMode::kUniform;
  settings.resolution = -5;
  EXPECT_EQ(plan::ReadSettings(ProtoFromSettings(settings).SerializeAsString()).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace bakewell::test
