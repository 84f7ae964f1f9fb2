// Coordinator, workers and clients together, over real sockets.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class FarmTest : public testing::Test {
 protected:
  static Farm::Options FastOptions(const std::filesystem::path& folder) {
    Farm::Options options;
    options.folder = folder;
    options.job.sched.heartbeat_timeout = seconds(3);
    return options;
  }
  static std::string BakeAlone(const SyntheticScene& scene, int workers, bool in_process) {
    const TempDir dir("/dev/shm");
    Farm::Options options = FastOptions(dir.path());
    options.in_process = in_process;
    Farm farm(options);
    for (int i = 0; i < workers; ++i) farm.AddWorker(absl::StrCat("w", i));
    const v1::Job job = farm.Bake(scene);
    EXPECT_EQ(job.state(), v1::DONE) << job.reason();
    EXPECT_EQ(job.artifacts_size(), 2);
    return DigestsOf(job);
  }

  TempDir dir{"/dev/shm"};
  SyntheticScene scene;
};

TEST_F(FarmTest, DigestsAreTheSameForAnyNumberOfWorkersAndInProcess) {
  const std::string one = BakeAlone(scene, 1, false);
  EXPECT_EQ(BakeAlone(scene, 2, false), one);
  EXPECT_EQ(BakeAlone(scene, 8, false), one);
  EXPECT_EQ(BakeAlone(scene, 2, true), one);
  SyntheticScene one_stage = scene;
  one_stage.two_stages = false;
  EXPECT_EQ(BakeAlone(one_stage, 2, true), BakeAlone(one_stage, 1, false));
}

TEST_F(FarmTest, SecondSubmitRunsNoTaskAndIsQuick) {
  Farm farm(FastOptions(dir.path()));
  auto& worker = farm.AddWorker("w");
  const v1::Job first = farm.Bake(scene);
  const int runs = worker.executor.runs;
  const auto start = std::chrono::steady_clock::now();
  const v1::Job second = farm.Bake(scene);
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(200));
  EXPECT_EQ(worker.executor.runs, runs);
  EXPECT_NE(second.id(), first.id());
  EXPECT_EQ(second.tasks_known(), second.tasks_total());
  EXPECT_EQ(DigestsOf(second), DigestsOf(first));
}

TEST_F(FarmTest, SameClientKeyIsTheSameJob) {
  Farm farm(FastOptions(dir.path()));
  const auto client = farm.Client();
  const auto first = client->Submit(scene.Text(), {"key", "", "", false});
  const auto second = client->Submit(scene.Text(), {"key", "", "", false});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->job_id(), second->job_id());
  EXPECT_TRUE(second->existed());
  scene.seed = 2;
  EXPECT_EQ(client->Submit(scene.Text(), {"key", "", "", false}).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(FarmTest, BadScenesAndSettingsAreRefusedAtSubmit) {
  Farm farm(FastOptions(dir.path()));
  const auto client = farm.Client();
  EXPECT_EQ(client->Submit("no scene", {}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client->Submit(scene.Text(), {"", "", "unknown", false}).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(client->Submit(scene.Text(), {"", "../name", "", false}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(FarmTest, QuotasAreKept) {
  Farm::Options options = FastOptions(dir.path());
  options.job.defaults.max_jobs = 1;
  options.job.defaults.max_scene_bytes = 1000;
  Farm farm(options);
  const auto client = farm.Client();
  EXPECT_TRUE(client->Submit(scene.Text(), {}).ok());
  EXPECT_EQ(client->Submit(scene.Text(), {}).status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(client->Submit(std::string(2000, 'x'), {}).status().code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(FarmTest, EstimateCountsWhatIsKnown) {
  Farm farm(FastOptions(dir.path()));
  scene.two_stages = false;
  const auto before = farm.Client()->Estimate(scene.Text(), {});
  ASSERT_TRUE(before.ok()) << before.status();
  EXPECT_EQ(before->tasks(), 1 + 24 + 1);
  EXPECT_EQ(before->tasks_known(), 0);
  EXPECT_GT(before->run_us_high(), before->run_us_low());
  farm.AddWorker("w");
  farm.Bake(scene);
  const auto after = farm.Client()->Estimate(scene.Text(), {});
  EXPECT_EQ(after->tasks_known(), after->tasks());
  EXPECT_EQ(after->run_us_high(), 0);
}

TEST_F(FarmTest, EstimateIsOfMeasuredCostsAlsoAfterARestartAndKeysAreNot) {
  Farm farm(FastOptions(dir.path()));
  scene.two_stages = false;
  SyntheticScene other = scene;
  other.seed = 99;
  const auto guess = farm.Client()->Estimate(other.Text(), {});
  ASSERT_TRUE(guess.ok()) << guess.status();
  // Tasks take ten times what the planner thinks.
  Farm::RunningWorker& worker = farm.AddWorker("w");
  worker.executor.before = [this](const TaskSpec&) {
    std::this_thread::sleep_for(std::chrono::microseconds(9 * scene.work_us));
    return absl::OkStatus();
  };
  farm.Bake(scene);
  const auto learnt = farm.Client()->Estimate(other.Text(), {});
  EXPECT_GT(learnt->run_us_low(), 6 * guess->run_us_low());
  EXPECT_LT(learnt->run_us_low(), 40 * guess->run_us_low()) << "not by what a loaded machine adds to a sleep";
  farm.StopCoordinator();
  farm.StartCoordinator();
  const auto after = farm.Client()->Estimate(other.Text(), {});
  EXPECT_GT(after->run_us_low(), 6 * guess->run_us_low());
  // What was learnt changes no key: the same scene again runs nothing.
  const int runs = worker.executor.runs;
  const v1::Job again = farm.Bake(scene, "again");
  EXPECT_EQ(again.tasks_known(), again.tasks_total());
  EXPECT_EQ(worker.executor.runs, runs);
}

// Symptom: a coordinator that was killed while photons flew took a part of them for all, and so did every later job.
TEST_F(FarmTest, WhatAStoppedTaskHandsInIsNoResult) {
  scene.work_us = 400'000;
  scene.width = 2;
  scene.layers = 1;
  Farm quiet(FastOptions(dir.path() / "quiet"));
  quiet.AddWorker("w");
  const std::string right = DigestsOf(quiet.Bake(scene));
  Farm farm(FastOptions(dir.path() / "farm"));
  Farm::RunningWorker& worker = farm.AddWorker("w");
  worker.executor.careless = true;
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_TRUE(WaitFor([&] { return worker.executor.runs > 0; }));
  ASSERT_TRUE(client->Cancel(job->job_id()).ok());
  ASSERT_TRUE(WaitFor([&] { return client->Workers()->workers(0).leases() == 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // what it hands in would have come
  worker.executor.careless = false;
  EXPECT_EQ(DigestsOf(farm.Bake(scene, "again")), right);
}

TEST_F(FarmTest, FetchWritesTheArtifactsAndResumes) {
  Farm farm(FastOptions(dir.path() / "farm"));
  farm.AddWorker("w");
  scene.bytes = 3 << 20;
  scene.width = 2;
  const v1::Job job = farm.Bake(scene);
  const auto client = farm.Client();
  ASSERT_TRUE(client->FetchAll(job, dir.path() / "out").ok());
  const auto whole = dir.path() / "out" / "out";
  ASSERT_EQ(std::filesystem::file_size(whole), 3u << 20);
  // A part that a crash left is continued, one that is wrong is fetched anew.
  std::filesystem::copy_file(whole, dir.path() / "out" / "out.part");
  std::filesystem::resize_file(dir.path() / "out" / "out.part", 1000);
  std::filesystem::remove(whole);
  EXPECT_TRUE(client->FetchAll(job, dir.path() / "out").ok());
  std::filesystem::remove(whole);
  std::ofstream(dir.path() / "out" / "out.part") << "something else";
  EXPECT_TRUE(client->FetchAll(job, dir.path() / "out").ok());
  EXPECT_EQ(std::filesystem::file_size(whole), 3u << 20);
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "out" / "out.part"));
}

TEST_F(FarmTest, CancelFreesTheWorkerWithinASecondAndKeepsWhatIsDone) {
  Farm farm(FastOptions(dir.path()));
  auto& worker = farm.AddWorker("w");
  scene.work_us = 300'000;
  scene.layers = 30;
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() >= 3; }));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(client->Cancel(job->job_id())->state(), v1::CANCELLED);
  scene.layers = 1;
  scene.work_us = 0;
  scene.seed = 5;
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
  EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(1));
  scene = {8, 30, 300'000, 0, 256, 1, true};
  const int runs = worker.executor.runs;
  const auto again = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return client->Get(again->job_id())->tasks_known() >= 3; }));
  EXPECT_LE(worker.executor.runs, runs + 4);
  EXPECT_TRUE(client->Cancel(again->job_id()).ok());
}

TEST_F(FarmTest, FailingTaskFailsItsJobWithTheReasonAndNoOther) {
  Farm farm(FastOptions(dir.path()));
  for (int i = 0; i < 3; ++i) {
    farm.AddWorker(absl::StrCat("w", i)).executor.before = [](const TaskSpec& spec) {
      return spec.kind == "test/join" && spec.inputs.size() == 5 ? absl::InternalError("it does not join")
                                                                 : absl::OkStatus();
    };
  }
  scene.width = 5;
  const v1::Job bad = farm.Bake(scene);
  EXPECT_EQ(bad.state(), v1::FAILED);
  EXPECT_EQ(bad.reason(), "it does not join");
  EXPECT_EQ(bad.code(), static_cast<int>(absl::StatusCode::kInternal));
  scene.width = 6;
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(FarmTest, RestartedCoordinatorGoesOnAndWorkersComeBack) {
  const std::string quiet = BakeAlone(scene, 2, false);
  Farm farm(FastOptions(dir.path()));
  auto& worker = farm.AddWorker("w");
  scene.work_us = 20'000;
  const std::string slow_quiet = BakeAlone(scene, 2, false);
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return worker.executor.runs > 5; }));
  farm.StopCoordinator();
  farm.StartCoordinator();
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE);
  EXPECT_EQ(DigestsOf(*ended), slow_quiet);
  EXPECT_GT(ended->tasks_known(), 0);
}

TEST_F(FarmTest, CorruptedBlobIsMadeAgain) {
  Farm farm(FastOptions(dir.path()));
  const std::string quiet = BakeAlone(scene, 1, false);
  auto& first = farm.AddWorker("first");
  first.executor.before = [](const TaskSpec& spec) {
    return spec.kind == "test/join" ? absl::UnavailableError("not me") : absl::OkStatus();
  };
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() == 25; }));
  // Every blob but the scene rots.
  for (const auto& file : std::filesystem::recursive_directory_iterator(dir.path() / "blobs")) {
    if (!file.is_regular_file() || file.path().filename() == Sha256Of(scene.Text()).Hex()) continue;
    std::ofstream(file.path(), std::ios::in | std::ios::out) << "rot";
  }
  farm.StopWorkers();
  farm.AddWorker("second");
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
  EXPECT_EQ(DigestsOf(*ended), quiet);
}

// Symptom: whoever failed a task before a restart is not known after it. It may have the task once more; the job ends
// well all the same, as its tries are counted anew.
TEST_F(FarmTest, FailuresBeforeARestartAreForgotten) {
  Farm farm(FastOptions(dir.path()));
  auto& bad = farm.AddWorker("bad");
  bad.executor.before = [](const TaskSpec& spec) {
    return spec.kind == "test/join" ? absl::UnavailableError("not me") : absl::OkStatus();
  };
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return farm.coordinator().GetStats().failed > 0; }));
  farm.StopCoordinator();
  farm.StartCoordinator();
  farm.AddWorker("good");
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
}

TEST_F(FarmTest, DrainedWorkerFinishesAndLeaves) {
  Farm farm(FastOptions(dir.path()));
  auto& worker = farm.AddWorker("w");
  scene.work_us = 50'000;
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return worker.executor.runs > 2; }));
  const auto workers = client->Workers();
  ASSERT_EQ(workers->workers_size(), 1);
  ASSERT_TRUE(client->DrainWorker(workers->workers(0).id(), true).ok());
  worker.thread.join();
  EXPECT_TRUE(worker.result.ok()) << worker.result;
  EXPECT_EQ(farm.coordinator().GetStats().workers, 0u);
  EXPECT_EQ(farm.coordinator().GetStats().leases, 0u);
  EXPECT_EQ(farm.coordinator().GetStats().failed, 0);
}

// Symptom: a worker that was told to leave just before it began to listen for leases listened for ever.
TEST_F(FarmTest, WorkerDrainedAtAnyMomentLeaves) {
  Farm::Options options = FastOptions(dir.path());
  options.job.sched.heartbeat_timeout = seconds(60);  // who is gone has said so, and the early one is not silent yet
  Farm farm(options);
  FarmLink link(farm.Connect());
  const auto registered = link.Register({"early", "test", 1, 1 << 20, SyntheticExecutor().Kinds()}, {});
  ASSERT_TRUE(registered.ok()) << registered.status();
  link.HangUpForGood();
  EXPECT_TRUE(absl::IsCancelled(link.Listen(registered->worker_id, 1, [](const LeaseNews&) {})));
  for (int i = 0; i < 100; ++i) {
    auto& worker = farm.AddWorker(absl::StrCat("w", i));
    std::this_thread::sleep_for(std::chrono::microseconds(50 * i));
    worker.worker->Drain();
    worker.thread.join();
    EXPECT_TRUE(worker.result.ok()) << worker.result;
  }
  EXPECT_TRUE(WaitFor([&] { return farm.coordinator().GetStats().workers == 1; })) << "the early one";
}

// Symptom: memory that ended in the planner ended the coordinator.
TEST_F(FarmTest, PlannerThatThrowsFailsTheCallOnly) {
  Farm farm(FastOptions(dir.path()));
  const auto client = farm.Client();
  EXPECT_EQ(client->Submit(scene.Text(), {"", "", "throw", false}).status().code(),
            absl::StatusCode::kResourceExhausted);
  farm.AddWorker("w");
  // In the second stage, which nobody waits for with a call.
  const auto job = client->Submit(scene.Text(), {"", "", "throw later", false});
  ASSERT_TRUE(job.ok()) << job.status();
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::FAILED);
  EXPECT_EQ(ended->reason(), "out of memory");
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

// Symptom: a job whose graph could not be read after a restart was running for ever.
TEST_F(FarmTest, JobThatCannotGoOnAfterARestartFails) {
  Farm farm(FastOptions(dir.path()));
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_TRUE(farm.coordinator()
                  .writer()
                  .Run([&](store::Tables& tables) { return tables.InsertStage(job->job_id(), 0, "no graph"); })
                  .ok());
  farm.StopCoordinator();
  farm.StartCoordinator();
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::FAILED);
  EXPECT_NE(ended->reason().find("submit it again"), std::string::npos) << ended->reason();
  farm.AddWorker("w");
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(FarmTest, ListedJobsHaveNoPhasesAndNoFiles) {
  Farm farm(FastOptions(dir.path()));
  farm.AddWorker("w");
  const v1::Job job = farm.Bake(scene);
  EXPECT_GT(job.phases_size(), 0);
  const auto jobs = farm.Client()->List({}, 10);
  ASSERT_TRUE(jobs.ok() && jobs->size() == 1u) << jobs.status();
  EXPECT_EQ(jobs->front().phases_size() + jobs->front().artifacts_size() + jobs->front().previews_size(), 0);
}

TEST_F(FarmTest, OnceAndIdleExitEndTheWorker) {
  Farm farm(FastOptions(dir.path()));
  const auto client = farm.Client();
  client->Submit(scene.Text(), {}).status().IgnoreError();
  WorkerOptions once;
  once.once = true;
  auto& one = farm.AddWorker("once", once);
  one.thread.join();
  EXPECT_EQ(one.executor.runs, 1);
  WorkerOptions idle;
  idle.idle_exit = milliseconds(300);
  auto& other = farm.AddWorker("idle", idle);
  other.thread.join();
  EXPECT_TRUE(other.result.ok());
}

TEST_F(FarmTest, WorkerOfAnotherVersionIsRefusedPolitely) {
  class Old final : public TaskExecutor {
   public:
    std::vector<TaskKind> Kinds() const override { return {{"test/chain", 7}}; }
    absl::StatusOr<MadeOutputs> Run(const TaskSpec&, const TaskInputs&, std::stop_token) override {
      return MadeOutputs();
    }
  };
  Farm farm(FastOptions(dir.path()));
  Old old;
  WorkerOptions options;
  options.identity = {"old", "", 1, 1 << 20, {}};
  Worker worker(farm.Connect(), old, options);
  const absl::Status status = worker.Run();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(status.message().find("test/chain v7"), absl::string_view::npos) << status;
}

}  // namespace
}  // namespace bakewell::test
