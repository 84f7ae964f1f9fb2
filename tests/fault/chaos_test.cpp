// kill -9 at random moments over coordinator and workers, cut connections, rotten blobs, a worker that hangs: the job
// ends with the bytes of a quiet run. BAKEWELL_CHAOS_KILLS sets how many (tests/bench/farm/run.sh: 100).
#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <random>

#include "tests/support/farm.h"
#include "tests/support/process.h"
#include "tests/support/proxy.h"
#include "tests/support/temp_dir.h"

namespace bakewell::test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;

int KillsWanted() {
  const char* set = std::getenv("BAKEWELL_CHAOS_KILLS");
  return set == nullptr ? 12 : std::atoi(set);
}

std::string QuietDigests(const SyntheticScene& scene) {
  const TempDir dir("/dev/shm");
  Farm::Options options;
  options.folder = dir.path();
  options.in_process = true;
  Farm farm(options);
  for (int i = 0; i < 4; ++i) farm.AddWorker(absl::StrCat("quiet", i));
  return DigestsOf(farm.Bake(scene));
}

class Chaos : public testing::Test {
 protected:
  void StartServer() {
    server_.emplace(
        std::vector<std::string>{SYNTHETIC_SERVER, "--data", (dir_.path() / "data").string(), "serve", "--listen",
                                 absl::StrCat("127.0.0.1:", port_), "--http", "", "--heartbeat-timeout", "2"},
        (dir_.path() / "server.log").string());
    ASSERT_EQ(server_->ReadLine().rfind("ready", 0), 0u);
  }
  void StartWorker(size_t index, const std::string& fault = "") {
    workers_.resize(std::max(workers_.size(), index + 1));
    workers_[index] = std::make_unique<Process>(
        std::vector<std::string>{SYNTHETIC_WORKER, "--server", absl::StrCat("localhost:", proxy_->port()), "--threads",
                                 "2", "--name", absl::StrCat("w", index), "--grace", "1"},
        (dir_.path() / "worker.log").string(), std::map<std::string, std::string>{{"BAKEWELL_TEST_FAULT", fault}});
  }
  // Overwrites the beginning of some blob, not of a scene (a client would have to send it again).
  void RotABlob(const std::string& scene_hex) {
    std::vector<fs::path> blobs;
    for (const auto& file : fs::recursive_directory_iterator(dir_.path() / "data" / "blobs")) {
      if (file.is_regular_file() && file.path().filename() != scene_hex) blobs.push_back(file.path());
    }
    if (blobs.empty()) return;
    std::ofstream(blobs[random_() % blobs.size()], std::ios::in | std::ios::out) << "rot";
  }
  void KillSomething() {
    const size_t victim = random_() % (workers_.size() + 1);
    if (victim == workers_.size()) {
      server_->Kill();
      StartServer();
    } else {
      workers_[victim]->Kill();
      StartWorker(victim);
    }
  }
  std::unique_ptr<FarmClient> Client() {
    ConnectOptions options;
    options.address = absl::StrCat("localhost:", proxy_->port());
    return std::make_unique<FarmClient>(*Connection::Open(options), seconds(60));
  }

  TempDir dir_{"/dev/shm"};
  const int port_ = FreePort();
  std::unique_ptr<Proxy> proxy_ = std::make_unique<Proxy>(port_);
  std::optional<Process> server_;
  std::vector<std::unique_ptr<Process>> workers_;
  std::minstd_rand random_{7};
};

TEST_F(Chaos, JobSurvivesKillsCutsAndRotWithTheSameBytes) {
  const int kills = KillsWanted();
  const SyntheticScene scene{16, 4 + kills, 60'000, 0, 4096, 3, true};
  const std::string quiet = QuietDigests(scene);
  StartServer();
  for (size_t i = 0; i < 3; ++i) StartWorker(i);
  StartWorker(3, "hang");
  const auto submitted = Client()->Submit(scene.Text(), {"chaos", "chaos", "", false});
  ASSERT_TRUE(submitted.ok()) << submitted.status();

  std::optional<absl::StatusOr<v1::Job>> ended;
  int64_t most_done = 0;
  std::thread watcher([&] {
    ended = Client()->Watch(submitted->job_id(), [&](const v1::Job& job) {
      most_done = std::max(most_done, job.tasks_done());
      return true;
    });
  });
  proxy_->SetDelay(3);
  int done_kills = 0;
  for (; done_kills < kills; ++done_kills) {
    std::this_thread::sleep_for(milliseconds(100 + random_() % 500));
    KillSomething();
    if (random_() % 3 == 0) proxy_->DropAll();
    if (random_() % 4 == 0) RotABlob(Sha256Of(scene.Text()).Hex());
  }
  proxy_->SetDelay(0);
  watcher.join();
  ASSERT_TRUE(ended->ok()) << ended->status();
  EXPECT_EQ((*ended)->state(), v1::DONE) << (*ended)->reason();
  EXPECT_EQ(DigestsOf(**ended), quiet);

  // What was acknowledged is there after one more kill; nothing is left over.
  server_->Kill();
  StartServer();
  const auto job = Client()->Get(submitted->job_id());
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(DigestsOf(*job), quiet);
  EXPECT_TRUE(fs::is_empty(dir_.path() / "data" / "incoming"));
  const auto again = Client()->Submit(scene.Text(), {"chaos", "chaos", "", false});
  EXPECT_EQ(again->job_id(), submitted->job_id());
  EXPECT_TRUE(WaitFor([&] { return Client()->Status()->leases() == 0; }));
  workers_[3]->Kill();  // which hangs, unless it was killed before
  for (size_t i = 0; i < 3; ++i) workers_[i]->Signal(SIGTERM);
  for (size_t i = 0; i < 3; ++i) EXPECT_EQ(workers_[i]->Wait(seconds(10)), 0) << i;
  EXPECT_TRUE(WaitFor([&] { return Client()->Status()->workers() == 0; }, seconds(10)));
  std::printf("chaos: %d kills, %d connections through the proxy, %lld tasks\n", done_kills, proxy_->connections(),
              static_cast<long long>(job->tasks_total()));
}

// Symptom: in a cluster nobody can make the first token: the server does not start without one, and prints what it
// makes.
TEST_F(Chaos, TokenFromAFileIsTakenAndNotPrinted) {
  const std::string secret(40, 's'), file = dir_.path() / "token", data = dir_.path() / "data";
  const auto add = [&] {
    return Process(
        {SYNTHETIC_SERVER, "--data", data, "token", "add", "--user", "w", "--scopes", "read", "--file", file},
        (dir_.path() / "token.log").string());
  };
  EXPECT_EQ(add().Wait(seconds(10)), 1) << "there is no such file";
  std::ofstream(file) << "short";
  EXPECT_EQ(add().Wait(seconds(10)), 1);
  std::ofstream(file) << secret << "\n";
  for (int i = 0; i < 2; ++i) {
    Process again = add();
    EXPECT_EQ(again.ReadLine(seconds(5)), "");
    EXPECT_EQ(again.Wait(seconds(10)), 0);
  }
  StartServer();
  ConnectOptions options;
  options.address = absl::StrCat("localhost:", port_);
  EXPECT_TRUE(absl::IsUnauthenticated(FarmClient(*Connection::Open(options), seconds(5)).Status().status()));
  options.token = secret;
  EXPECT_TRUE(FarmClient(*Connection::Open(options), seconds(5)).Status().ok());
}

// Symptom: a worker whose task does not listen left the farm after its grace, and its process stayed.
TEST_F(Chaos, SigtermEndsAWorkerWhoseTaskHangs) {
  StartServer();
  Process hung({SYNTHETIC_WORKER, "--server", absl::StrCat("localhost:", port_), "--name", "hung", "--grace", "0.5"},
               (dir_.path() / "hung.log").string(), {{"BAKEWELL_TEST_FAULT", "hang"}});
  const auto submitted = Client()->Submit(SyntheticScene().Text(), {"hang", "", "", false});
  ASSERT_TRUE(submitted.ok()) << submitted.status();
  ASSERT_TRUE(WaitFor([&] { return Client()->Status()->leases() > 0; }));
  hung.Signal(SIGTERM);
  EXPECT_EQ(hung.Wait(seconds(10)), 0);
  EXPECT_EQ(Client()->Status()->leases(), 0);
}

TEST_F(Chaos, SigtermEndsTheServerAndTheJobGoesOnAfterwards) {
  StartServer();
  StartWorker(0);
  const SyntheticScene scene{8, 4, 50'000, 0, 100, 11, true};
  const auto submitted = Client()->Submit(scene.Text(), {"term", "", "", false});
  ASSERT_TRUE(submitted.ok());
  std::this_thread::sleep_for(milliseconds(300));
  server_->Signal(SIGTERM);
  EXPECT_EQ(server_->Wait(seconds(10)), 0);
  StartServer();
  const auto ended = Client()->Watch(submitted->job_id(), [](const v1::Job&) { return true; });
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::DONE);
}

}  // namespace
}  // namespace bakewell::test
