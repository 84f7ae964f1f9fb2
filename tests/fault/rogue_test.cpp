// Workers that answer late, twice, wrongly or not at all, and clocks that jump.
#include <gtest/gtest.h>

#include <atomic>
#include <map>

#include "proto/rpc/transfer.h"
#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// A worker by hand: takes leases, and does with them what the test wants.
class Rogue {
 public:
  explicit Rogue(Farm& farm) : link_(farm.Connect()) {
    const auto registered = link_.Register({"rogue", "test", 1, int64_t{1} << 30, SyntheticExecutor().Kinds()}, {});
    EXPECT_TRUE(registered.ok()) << registered.status();
    id_ = registered->worker_id;
    listener_ = std::thread([this] {
      link_
          .Listen(id_, 4,
                  [this](LeaseNews news) {
                    const std::lock_guard lock(mutex_);
                    for (LeasedTask& lease : news.leases) leases_.push_back(std::move(lease));
                  })
          .IgnoreError();
    });
  }
  ~Rogue() {
    link_.HangUpForGood();
    listener_.join();
  }
  LeasedTask Next() {
    EXPECT_TRUE(WaitFor([&] {
      const std::lock_guard lock(mutex_);
      return !leases_.empty();
    }));
    const std::lock_guard lock(mutex_);
    const LeasedTask lease = leases_.front();
    leases_.erase(leases_.begin());
    return lease;
  }
  TaskOutputs Upload(const std::string& bytes) {
    EXPECT_TRUE(UploadBlob(link_.connection(), Sha256Of(bytes), bytes).ok());
    return {{"out", Sha256Of(bytes), std::ssize(bytes)}};
  }
  std::string Make(const LeasedTask& lease) {
    TaskInputs inputs;
    for (const TaskInput& input : lease.spec.inputs) {
      const auto bytes = DownloadBlob(link_.connection(), std::get<Digest>(input.source), 1 << 20, 1);
      inputs.emplace_back(input.name, std::make_shared<const std::string>(*bytes));
    }
    return SyntheticExecutor().Run(lease.spec, inputs, {})->front().bytes;
  }
  FarmLink& link() { return link_; }
  uint64_t id() const { return id_; }

 private:
  FarmLink link_;
  uint64_t id_ = 0;
  std::mutex mutex_;
  std::vector<LeasedTask> leases_;
  std::thread listener_;
};

class RogueTest : public testing::Test {
 protected:
  static Farm::Options OptionsIn(const std::filesystem::path& folder) {
    Farm::Options options;
    options.folder = folder;
    options.job.sched.heartbeat_timeout = milliseconds(800);
    options.job.sched.min_run_limit = milliseconds(1500);
    options.job.sched.run_limit_factor = 1;
    return options;
  }
  TempDir dir{"/dev/shm"};
  SyntheticScene scene{4, 2, 1000, 0, 64, 1, true};
};

TEST_F(RogueTest, LateAndDoubledCompletionsOfTheSameBytesAreWelcome) {
  Farm farm(OptionsIn(dir.path()));
  Rogue rogue(farm);
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  const LeasedTask lease = rogue.Next();
  const TaskOutputs outputs = rogue.Upload(rogue.Make(lease));
  ASSERT_TRUE(WaitFor([&] { return farm.coordinator().GetStats().lost_leases == 1; }));
  EXPECT_TRUE(rogue.link().Complete(rogue.id(), lease, outputs, milliseconds(1)).ok());
  EXPECT_TRUE(rogue.link().Complete(rogue.id(), lease, outputs, milliseconds(1)).ok());
  EXPECT_EQ(farm.coordinator().GetStats().conflicts, 0);
  farm.AddWorker("good");
  EXPECT_EQ(client->Watch(job->job_id(), [](const v1::Job&) { return true; })->state(), v1::DONE);
  EXPECT_TRUE(rogue.link().Complete(rogue.id(), lease, outputs, milliseconds(1)).ok());
}

TEST_F(RogueTest, OtherBytesForAFinishedTaskAreReportedAndChangeNothing) {
  Farm farm(OptionsIn(dir.path()));
  Rogue rogue(farm);
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  const LeasedTask lease = rogue.Next();
  scene.work_us = 1000;
  farm.AddWorker("good");
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->state() == v1::DONE; }));
  const TaskOutputs wrong = rogue.Upload("wrong bytes");
  const absl::Status late = rogue.link().Complete(rogue.id(), lease, wrong, milliseconds(1));
  EXPECT_EQ(late.code(), absl::StatusCode::kAborted) << late;
  EXPECT_NE(DigestsOf(*client->Get(job->job_id())).find("out"), std::string::npos);
  EXPECT_EQ(farm.Bake(scene).state(), v1::DONE);
}

TEST_F(RogueTest, BytesThatAreNotTheDigestsAreRefused) {
  Farm farm(OptionsIn(dir.path()));
  Rogue rogue(farm);
  farm.Client()->Submit(scene.Text(), {}).status().IgnoreError();
  const LeasedTask lease = rogue.Next();
  EXPECT_EQ(UploadBlob(rogue.link().connection(), Sha256Of("promised"), "sent").code(), absl::StatusCode::kDataLoss);
  const TaskOutputs claimed = {{"out", Sha256Of("promised"), 8}};
  EXPECT_EQ(rogue.link().Complete(rogue.id(), lease, claimed, milliseconds(1)).code(), absl::StatusCode::kNotFound);
  rogue.Upload("promised");
  const TaskOutputs bad_size = {{"out", Sha256Of("promised"), 9}};
  EXPECT_EQ(rogue.link().Complete(rogue.id(), lease, bad_size, milliseconds(1)).code(), absl::StatusCode::kNotFound);
  const TaskOutputs bad_name = {{"../out", Sha256Of("promised"), 8}};
  EXPECT_EQ(rogue.link().Complete(rogue.id(), lease, bad_name, milliseconds(1)).code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(RogueTest, HangingWorkerIsOvertaken) {
  Farm farm(OptionsIn(dir.path()));
  auto& hanging = farm.AddWorker("hanging");
  std::atomic<bool> release{false};
  hanging.executor.before = [&](const TaskSpec&) {
    while (!release) std::this_thread::sleep_for(milliseconds(10));
    return absl::UnavailableError("woke up");
  };
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return hanging.executor.runs > 0; }));
  farm.AddWorker("good");
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
  release = true;
}

TEST_F(RogueTest, ClocksMayJump) {
  std::atomic<int64_t> wall_offset_us{0}, steady_offset_us{0};
  Farm::Options options = OptionsIn(dir.path());
  options.job.sched.heartbeat_timeout = seconds(10);
  options.job.wall_now_us = [&] {
    return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
               .count() +
           wall_offset_us;
  };
  options.job.steady_now = [&] {
    return std::chrono::duration_cast<sched::Time>(std::chrono::steady_clock::now().time_since_epoch()) +
           sched::Time(steady_offset_us);
  };
  Farm farm(options);
  farm.AddWorker("w1");
  farm.AddWorker("w2");
  scene.layers = 20;
  scene.work_us = 20'000;
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() > 10; }));
  wall_offset_us = -int64_t{86'400'000'000};
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() > 20; }));
  wall_offset_us = int64_t{365} * 86'400'000'000;
  steady_offset_us = int64_t{3'600'000'000};  // the machine slept for an hour: every lease runs out
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
}

}  // namespace
}  // namespace bakewell::test
