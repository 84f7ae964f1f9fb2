// A real level through planner, charts, photons and gather: the same files from one worker and from three.
#include <gtest/gtest.h>

#include "client/gltf/level.h"
#include "core/artifact/level_task.h"
#include "core/base/fields.h"
#include "core/image/png.h"
#include "core/scene/canonical.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"
#include "server/level/chart_task.h"
#include "server/plan/level_planner.h"
#include "tests/support/farm.h"
#include "tests/support/level_farm.h"
#include "tests/support/temp_dir.h"
#include "worker/level/executor.h"

namespace bakewell::test {
namespace {

std::string SampleScene() {
  const std::vector<std::byte> bytes =
      SerializeScene(LoadLevel(std::string(BAKEWELL_SOURCE_DIR) + "/tests/scenes/sample.glb").value().scene);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

absl::StatusOr<v1::SubmitResponse> SubmitLevel(FarmClient& client, const std::string& scene,
                                               const BakeSettings& settings) {
  return client.Submit(scene, {"", "", ProtoFromSettings(settings).SerializeAsString(), false});
}

v1::Job BakeLevel(const std::string& scene, const BakeSettings& settings, int workers) {
  const LevelFarm farm(workers);
  FarmClient client(farm.Connect());
  const auto submitted = SubmitLevel(client, scene, settings);
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  return submitted.ok() ? *client.Watch(submitted->job_id(), [](const v1::Job&) { return true; }) : v1::Job();
}

TEST(LevelFarm, FilesAreTheSameForAnyNumberOfWorkers) {
  const std::string scene = SampleScene();
  BakeSettings settings;
  settings.quality = Quality::kPreview;
  settings.resolution = 64;
  const v1::Job one = BakeLevel(scene, settings, 1), three = BakeLevel(scene, settings, 3);
  EXPECT_EQ(one.state(), v1::DONE) << one.reason();
  EXPECT_GE(one.artifacts_size(), 6);
  EXPECT_EQ(DigestsOf(one), DigestsOf(three));
}

// Watch says that a picture grows; Fetch gives it, and it does grow.
TEST(LevelFarm, PagesCanBeLookedAtWhileTheyAreGathered) {
  const std::string scene = SampleScene();
  BakeSettings settings;
  settings.quality = Quality::kHigh;
  settings.resolution = 160;
  const LevelFarm farm(1);
  FarmClient client(farm.Connect());
  const TempDir dir;
  const auto submitted = SubmitLevel(client, scene, settings);
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  std::vector<int64_t> lit;  // pixels of the picture each time that it had grown
  int64_t parts = 0;
  const auto job = client.Watch(submitted->job_id(), [&](const v1::Job& now) {
    if (now.state() != v1::RUNNING || now.previews_size() == 0 || now.previews(0).parts() == parts) return true;
    const v1::Preview& preview = now.previews(0);
    EXPECT_EQ(preview.name(), "preview-0.png");
    EXPECT_GT(preview.parts(), parts);
    const absl::Status fetched = client.FetchPreview(now.id(), preview, dir.path());
    if (absl::IsNotFound(fetched)) return true;  // the job has ended meanwhile
    EXPECT_TRUE(fetched.ok()) << fetched;
    parts = preview.parts();
    const auto picture = ReadPng(dir / "preview-0.png");
    EXPECT_TRUE(picture.ok()) << picture.status();
    if (!picture.ok()) return false;
    EXPECT_LE(picture->width, 80);
    lit.push_back(0);
    for (size_t i = 0; i < picture->PixelCount(); ++i) lit.back() += picture->Channel(0)[i] > 0;
    return true;
  });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::DONE) << job->reason();
  ASSERT_GE(lit.size(), 2u);
  EXPECT_GT(lit.front(), 0);
  EXPECT_GT(lit.back(), lit.front());
  EXPECT_EQ(job->previews_size(), 0) << "it has its pages now";
  v1::Preview gone;
  gone.set_name("preview-0.png");
  EXPECT_EQ(client.FetchPreview(job->id(), gone, dir.path()).code(), absl::StatusCode::kNotFound);
  gone.set_name("../preview-0.png");
  EXPECT_EQ(client.FetchPreview(job->id(), gone, dir.path()).code(), absl::StatusCode::kDataLoss);
}

// A task of the sample scene at 32 texels a side.
struct SampleTask {
  TaskSpec spec;
  TaskInputs inputs;

  explicit SampleTask(const level_task::KindName& kind) {
    const std::string scene = SampleScene();
    BakeSettings settings;
    settings.quality = Quality::kPreview;
    settings.resolution = 32;
    settings.photons = 100000;  // which the survey says to the tasks after it
    const std::string task = level_task::Serialize({SettingsJson(settings), 0, 1});
    const auto layout =
        ChartTasks()[0].run({level_task::kChart.kind, level_task::kChart.code_version, task, {}}, {scene});
    EXPECT_TRUE(layout.ok()) << layout.status();
    spec = {kind.kind, kind.code_version, task, {}};
    for (const auto& [name, blob] :
         {std::pair<std::string, std::string>("scene", scene), {"layout", (*layout)[0].bytes}}) {
      spec.inputs.push_back({name, Sha256Of(blob)});
      inputs.emplace_back(name, std::make_shared<const std::string>(blob));
    }
  }
};

TEST(LevelExecutor, StoppedPhotonsAreNoResult) {
  const SampleTask emit(level_task::kEmit);
  LevelExecutor executor;
  EXPECT_TRUE(executor.Run(emit.spec, emit.inputs, {}).ok());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(absl::IsCancelled(executor.Run(emit.spec, emit.inputs, stop.get_token()).status()));
}

// Symptom: a level of many textures loaded for five seconds after Ctrl-C, and the bar stood still meanwhile.
TEST(LevelExecutor, StopsWhileALevelLoadsAndSaysHowFarItIs) {
  class StopAt final : public Progress {
   public:
    explicit StopAt(int64_t step) : step_(step) {}
    void Report(std::string_view phase, int64_t done, int64_t total) override {
      EXPECT_EQ(phase, "texels");
      EXPECT_GE(done, last);
      EXPECT_LE(done, total);
      last = done;
      if (done == step_) stop.request_stop();
    }
    std::stop_source stop;
    int64_t last = 0;

   private:
    const int64_t step_;
  };
  const SampleTask survey(level_task::kSurvey);
  for (int step = 0; step < kSurveySteps; ++step) {
    StopAt progress(step);
    LevelExecutor executor({.threads = 1, .process_threads = 0, .progress = &progress});
    EXPECT_TRUE(absl::IsCancelled(executor.Run(survey.spec, survey.inputs, progress.stop.get_token()).status()));
    EXPECT_EQ(std::exchange(progress.last, 0), step);
    EXPECT_TRUE(executor.Run(survey.spec, survey.inputs, {}).ok()) << "what was stopped is made again";
    EXPECT_EQ(progress.last, kSurveySteps);
  }
}

TEST(LevelPlanner, ASurveyThatHasTheCacheLeavesNoPhotonsToFly) {
  const std::string scene = SampleScene();
  const plan::PlanRequest request{Sha256Of(scene), ProtoFromSettings({}).SerializeAsString()};
  const plan::LevelPlanner planner;
  for (const bool has_cache : {false, true}) {
    level_task::Survey survey;
    survey.texels = 256;
    survey.photons = 32768;
    survey.has_cache = has_cache;
    survey.texels_of_tile = {256};
    survey.tile_end_of_page = {1};
    const std::string bytes = level_task::Serialize(survey);
    const plan::BlobReader read = [&](const Digest& digest) -> absl::StatusOr<std::string> {
      return digest == request.scene ? scene : bytes;
    };
    const auto first = planner.Plan(request, read);
    ASSERT_TRUE(first.ok()) << first.status();
    const TaskOutputs done = {{"cache", {}, 0}, {"survey", Sha256Of(bytes), std::ssize(bytes)}, {"totals", {}, 0}};
    EXPECT_EQ(planner.Continue(request, {*first}, {done[1]}, read).ok(), !has_cache);
    const auto rest = planner.Continue(request, {*first}, done, read);
    ASSERT_TRUE(rest.ok()) << rest.status();
    int photon_tasks = 0, from_survey = 0;
    for (const plan::PlannedTask& task : rest->tasks) {
      photon_tasks += task.spec.kind == level_task::kEmit.kind || task.spec.kind == level_task::kDensity.kind ? 1 : 0;
      for (const TaskInput& input : task.spec.inputs) {
        const auto* made = std::get_if<OutputOf>(&input.source);
        if (made == nullptr || (input.name != "cache" && input.name != "totals")) continue;
        from_survey += made->task == first->tasks[1].key ? 1 : 0;
      }
    }
    EXPECT_EQ(photon_tasks, has_cache ? 0 : 2);
    EXPECT_EQ(from_survey, has_cache ? 2 : 0);
  }
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
