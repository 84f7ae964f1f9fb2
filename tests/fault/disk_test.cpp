// A disk that fills up while a job runs: nothing is acknowledged that is not safe, and with space the job goes on.
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <fstream>

#include "client/local/bake.h"
#include "tests/support/bake_scene.h"
#include "tests/support/farm.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

// A small tmpfs of the test's own. Needs root, as the build machine has it.
class SmallDisk {
 public:
  explicit SmallDisk(const std::string& size) {
    ok_ = mount("tmpfs", dir_.path().c_str(), "tmpfs", 0, ("size=" + size).c_str()) == 0;
  }
  ~SmallDisk() {
    if (ok_) umount2(dir_.path().c_str(), MNT_DETACH);
  }
  bool ok() const { return ok_; }
  const std::filesystem::path& path() const { return dir_.path(); }

 private:
  TempDir dir_;
  bool ok_ = false;
};

// Symptom: every submit waited for the disk on one of eight io threads, and then nobody got an answer to anything.
void ExpectAnswersWhileNothingCanBeWritten(Farm& farm, const SyntheticScene& scene, int64_t job) {
  std::vector<std::thread> stubborn;
  for (int i = 0; i < 24; ++i) {
    stubborn.emplace_back([&farm, &scene, i] {
      FarmClient impatient(farm.Connect(), std::chrono::seconds(1));
      const auto refused = impatient.Submit(scene.Text(), {absl::StrCat("full", i), "", "", false});
      EXPECT_TRUE(absl::IsUnavailable(refused.status())) << refused.status();
    });
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_TRUE(FarmClient(farm.Connect(), std::chrono::seconds(2)).Get(job).ok());
  for (std::thread& thread : stubborn) thread.join();
}

TEST(FullDisk, JobWaitsForSpaceAndEndsWithTheSameBytes) {
  const SyntheticScene scene{8, 20, 5000, 0, 8192, 4, true};
  std::string quiet;
  {
    const TempDir dir("/dev/shm");
    Farm::Options options;
    options.folder = dir.path();
    Farm farm(options);
    farm.AddWorker("w");
    quiet = DigestsOf(farm.Bake(scene));
  }
  const SmallDisk disk("16m");
  ASSERT_TRUE(disk.ok()) << "cannot mount a tmpfs: run this test as root";
  Farm::Options options;
  options.folder = disk.path() / "farm";
  Farm farm(options);
  farm.AddWorker("w1");
  farm.AddWorker("w2");
  const auto client = farm.Client();
  const auto job = client->Submit(scene.Text(), {});
  ASSERT_TRUE(job.ok());
  ASSERT_TRUE(WaitFor([&] { return client->Get(job->job_id())->tasks_done() > 20; }));
  {
    std::ofstream filler(disk.path() / "filler", std::ios::binary);
    const std::string block(64 << 10, 'x');
    while (filler.write(block.data(), std::ssize(block)).flush()) {
    }
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const int64_t stuck = client->Get(job->job_id())->tasks_done();
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_LE(client->Get(job->job_id())->tasks_done(), stuck + 2);
  ExpectAnswersWhileNothingCanBeWritten(farm, scene, job->job_id());
  std::filesystem::remove(disk.path() / "filler");
  const auto ended = client->Watch(job->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE) << ended->reason();
  EXPECT_EQ(DigestsOf(*ended), quiet);
  EXPECT_TRUE(std::filesystem::is_empty(options.folder / "incoming"));
}

// Symptom: jobs that went on to their next stage waited for the disk, eight of them on all io threads. Another program
// that has the database is to the writer what a full disk is.
TEST(FullDisk, JobsThatGoOnHoldNoThread) {
  const TempDir dir("/dev/shm");
  Farm::Options options;
  options.folder = dir.path();
  Farm farm(options);
  job::Coordinator& coordinator = farm.coordinator();
  const auto client = farm.Client();
  std::vector<int64_t> jobs;
  for (int seed = 0; seed < 12; ++seed) {
    SyntheticScene scene;
    scene.seed = seed;
    jobs.push_back(client->Submit(scene.Text(), {}).value().job_id());
  }
  std::vector<job::TaskLease> roots;
  const sched::WorkerId worker =
      coordinator.AddWorker({"w", "test", 1, 1 << 30, coordinator.CapabilitiesOf(coordinator.kinds())});
  coordinator.Connect(worker, [&](job::LeaseNews news) {
    for (const job::TaskLease& lease : news.leases) roots.push_back(lease);
  });
  coordinator.AddCredit(worker, 64);
  ASSERT_EQ(roots.size(), jobs.size());
  const std::string bytes = SyntheticScene{}.Text();  // any blob will do
  const TaskOutputs outputs = {{"out", Sha256Of(bytes), std::ssize(bytes)}};
  ASSERT_TRUE(coordinator.blobs().Put(Sha256Of(bytes), bytes).ok());

  const auto other = store::Tables::Open(dir.path() / "farm.db");
  ASSERT_TRUE(other.ok() && (*other)->Begin().ok());
  for (const job::TaskLease& root : std::vector(roots)) {
    coordinator.Complete({worker, root.token, root.key, outputs, std::chrono::milliseconds(1)},
                         [](const absl::Status&) {});
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_TRUE(FarmClient(farm.Connect(), std::chrono::seconds(2)).Get(jobs[0]).ok());
  (*other)->Rollback();
  for (const int64_t job : jobs) {
    EXPECT_TRUE(WaitFor([&] { return client->Get(job)->tasks_total() > 1; })) << job;
  }
  coordinator.RemoveWorker(worker);
}

// Symptom: a farm waits for space, so a bake with a farm of its own waited for ever.
TEST(FullDisk, EmbeddedBakeEndsWithAnError) {
  const SmallDisk disk("300k");
  ASSERT_TRUE(disk.ok()) << "cannot mount a tmpfs: run this test as root";
  BakeSettings settings;
  settings.quality = Quality::kPreview;
  settings.resolution = 64;
  SilentProgress progress;
  const auto summary =
      Bake({std::string(BAKEWELL_SOURCE_DIR) + "/tests/scenes/sample.glb", disk.path() / "out", settings, 1}, progress);
  EXPECT_EQ(summary.status().code(), absl::StatusCode::kResourceExhausted) << summary.status();
  EXPECT_TRUE(std::filesystem::is_empty(disk.path()));
}

}  // namespace
}  // namespace bakewell::test
