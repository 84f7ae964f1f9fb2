// What nobody needs goes: when it is asked for, and by itself.
#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::minutes;

class CollectTest : public testing::Test {
 protected:
  // Time stands still but for Pass().
  Farm::Options StoppedOptions() {
    Farm::Options options;
    options.folder = dir.path();
    options.job.steady_now = [this] { return sched::Time(now_us.load()); };
    options.job.wall_now_us = [this] { return now_us.load(); };
    return options;
  }
  void Pass(microseconds time) { now_us += time.count(); }
  static Digest PutLoose(Farm& farm, const std::string& bytes) {
    const Digest digest = Sha256Of(bytes);
    EXPECT_TRUE(farm.coordinator().blobs().Put(digest, bytes).ok());
    std::promise<absl::Status> recorded;
    farm.coordinator().RecordBlob(digest, std::ssize(bytes),
                                  [&](const absl::Status& status) { recorded.set_value(status); });
    EXPECT_TRUE(recorded.get_future().get().ok());
    return digest;
  }
  // Longer than ten ticks.
  static void LetItTick() { std::this_thread::sleep_for(std::chrono::milliseconds(1200)); }

  std::atomic<int64_t> now_us{1'000'000'000'000};
  TempDir dir{"/dev/shm"};
};

TEST_F(CollectTest, KeepsWhatALiveJobNeeds) {
  Farm::Options options;
  options.folder = dir.path();
  Farm farm(options);
  auto& worker = farm.AddWorker("w");
  SyntheticScene scene;
  const v1::Job first = farm.Bake(scene);
  scene.seed = 9;
  scene.work_us = 50'000;
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() > 4; }));
  const auto report = client->CollectGarbage(0, microseconds(1));
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_GT(report->results(), 20);
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  EXPECT_EQ(ended->state(), v1::DONE);
  EXPECT_EQ(worker.worker->counters().failed, 0);
  const int64_t done = first.tasks_done() + ended->tasks_done();
  // A worker counts a task after the coordinator does.
  EXPECT_TRUE(WaitFor([&] { return worker.worker->counters().done == done; }));
  farm.Bake(scene);
  EXPECT_EQ(worker.worker->counters().done, done) << "what had been done before was forgotten";
}

TEST_F(CollectTest, HappensByItselfEveryHour) {
  Farm farm(StoppedOptions());
  farm.AddWorker("w");
  farm.Bake({});
  farm.StopWorkers();
  const size_t results = farm.coordinator().blobs().count();
  const Digest loose = PutLoose(farm, "nobody names this");
  Pass(minutes(59));
  LetItTick();
  EXPECT_TRUE(farm.coordinator().blobs().Has(loose));
  Pass(minutes(2));
  EXPECT_TRUE(WaitFor([&] { return !farm.coordinator().blobs().Has(loose); }));
  EXPECT_EQ(farm.coordinator().blobs().count(), results) << "without a quota, what is known stays known";
}

TEST_F(CollectTest, HurriesAboveWhatIsToBeKept) {
  Farm::Options options = StoppedOptions();
  options.job.collect_every = hours(20);
  options.job.quota_bytes = 1 << 20;
  options.job.keep_bytes = 4000;
  Farm farm(options);
  farm.AddWorker("w");
  farm.Bake({});
  farm.StopWorkers();
  const store::BlobStore& blobs = farm.coordinator().blobs();
  ASSERT_GT(blobs.total_bytes(), 5000);
  Pass(minutes(119));
  LetItTick();
  EXPECT_GT(blobs.total_bytes(), 5000);
  Pass(minutes(2));
  EXPECT_TRUE(WaitFor([&] { return blobs.total_bytes() <= 4000; })) << blobs.total_bytes();
}

}  // namespace
}  // namespace bakewell::test
