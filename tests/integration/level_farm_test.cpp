// A real level through planner, charts, photons and gather: the same files from one worker and from three.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include "client/gltf/level.h"
#include "core/artifact/level_task.h"
#include "core/scene/canonical.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"
#include "server/chart/choose.h"
#include "server/job/local_runner.h"
#include "server/plan/level_planner.h"
#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"
#include "worker/level/executor.h"

namespace bakewell::test {
namespace {

absl::StatusOr<std::vector<job::LocalBlob>> RunChart(const TaskSpec& spec, const std::vector<std::string>& inputs) {
  auto layout = RunChartTask(spec.settings, inputs[0]);
  if (!layout.ok()) return layout.status();
  return std::vector<job::LocalBlob>{{"layout", *layout}};
}

// Bakes on a farm of its own, in this process, over gRPC.
v1::Job BakeLevel(const std::string& scene, const BakeSettings& settings, int workers) {
  const TempDir dir("/dev/shm");
  const plan::LevelPlanner planner;
  job::Options options;
  options.folder = dir.path();
  const auto coordinator = job::Coordinator::Open(options, planner);
  EXPECT_TRUE(coordinator.ok()) << coordinator.status();
  const job::LocalRunner local(**coordinator, {{{level_task::kChart.kind, level_task::kChart.code_version}, RunChart}},
                               1);
  const auto server = rpc::FarmServer::Start(**coordinator, {});
  EXPECT_TRUE(server.ok()) << server.status();
  const auto connection = std::make_shared<Connection>((*server)->InProcessChannel(), "");
  std::vector<std::unique_ptr<LevelExecutor>> executors;
  std::vector<std::unique_ptr<Worker>> running;
  std::vector<std::thread> threads;
  for (int i = 0; i < workers; ++i) {
    WorkerOptions worker;
    worker.identity = {absl::StrCat("w", i), "", 1, int64_t{4} << 30, {}};
    executors.push_back(std::make_unique<LevelExecutor>());
    running.push_back(std::make_unique<Worker>(connection, *executors.back(), worker));
    threads.emplace_back([raw = running.back().get()] { EXPECT_TRUE(raw->Run().ok()); });
  }
  FarmClient client(connection);
  const auto submitted = client.Submit(scene, {"", "", ProtoFromSettings(settings).SerializeAsString(), false});
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  v1::Job ended;
  if (submitted.ok()) ended = *client.Watch(submitted->job_id(), [](const v1::Job&) { return true; });
  for (const auto& worker : running) worker->Drain();
  for (std::thread& thread : threads) thread.join();
  return ended;
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
