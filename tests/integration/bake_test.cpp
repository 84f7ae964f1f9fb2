// `bakewell bake`, `bakewell submit --wait` and the bare kernels give the same files.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "client/cli/cli.h"
#include "client/job/result.h"
#include "client/local/bake.h"
#include "client/local/farm.h"
#include "core/artifact/atomic_file.h"
#include "core/artifact/manifest.h"
#include "tests/support/bake_scene.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/level_farm.h"
#include "tests/support/slowness.h"
#include "tests/support/temp_dir.h"
#include "worker/finish/bands.h"
#include "worker/level/page_files.h"
#include "worker/level/report.h"

namespace bakewell::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kSample = std::string(BAKEWELL_SOURCE_DIR) + "/tests/scenes/sample.glb";

BakeSettings SmallSettings() {
  BakeSettings settings;
  settings.quality = Quality::kPreview;
  settings.resolution = 64;
  return settings;
}

std::set<std::string> NamesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

std::string BytesOf(const fs::path& path) { return ReadWholeFile(path).value(); }

Json ManifestOf(const fs::path& folder) { return Json::parse(BytesOf(folder / "manifest.json")); }

struct Outcome {
  int exit_code = 0;
  std::string out, err;
};
Outcome RunWith(const std::vector<std::string>& words) {
  std::vector<const char*> argv = {"bakewell"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  std::ostringstream out, err;
  const int exit_code =
      RunCli(static_cast<int>(argv.size()), argv.data(), {out, err}, Bakers{Bake, BakeReference, Unwrap});
  return {exit_code, out.str(), err.str()};
}

void ExpectTheBytesOfTheBareKernels(const BakeSettings& settings) {
  const TempDir dir;
  SilentProgress progress;
  const auto summary = Bake({kSample, dir.path() / "out", settings, 2}, progress);
  ASSERT_TRUE(summary.ok()) << summary.status();

  PhaseClock clock;
  const auto prepared = PrepareLevel(LoadLevel(kSample).value(), settings, clock, progress);
  ASSERT_TRUE(prepared.ok()) << prepared.status();
  auto baked = BakeTexels(*prepared, settings, clock, progress);
  ASSERT_TRUE(baked.ok()) << baked.status();
  const GatherOptions asked = BudgetOf(settings, std::ssize(prepared->texels.texels)).gather;
  BakeTally tally;
  tally.Count(baked->counters);
  for (int page = 0; page < static_cast<int>(prepared->texels.pages.size()); ++page) {
    std::vector<TexelLight> lights;
    for (size_t i = 0; i < baked->lights.size(); ++i) {
      if (prepared->texels.texels[i].page == page) lights.push_back(baked->lights[i]);
    }
    BakeTally of_page;
    SkipCount bands;
    DropBands(prepared->texels, page, asked.target_error, baked->lights, bands);
    of_page.Count(Skip::kShBands, bands);
    of_page.Count(lights, page == 0 ? baked->filter : FilterCounters());
    tally.Add(of_page);
    const auto files = PageFiles(prepared->texels, baked->lights, page);
    ASSERT_TRUE(files.ok()) << files.status();
    for (const MadeOutput& file : *files) {
      EXPECT_TRUE(BytesOf(dir.path() / "out" / file.name) == file.bytes) << file.name;
    }
  }

  const auto report =
      tally.Finish({baked->photons, baked->photon_rays, baked->density_rays, baked->cells, {}}, 0, settings.no_skip);
  ASSERT_TRUE(report.ok()) << report.status();
  const Json statistics = ManifestOf(dir.path() / "out")["statistics"];
  Manifest expected;
  expected.counters = report->counters;
  const Json written = Json::parse(ManifestJson(expected).value())["statistics"];
  EXPECT_EQ(statistics["counters"], written["counters"]);
  EXPECT_EQ(statistics["skip"], written["skip"]);
  EXPECT_GT(statistics["skip"]["invalid_texels"]["of"], 0);
  EXPECT_EQ(statistics["estimated_error"], report->estimated_error);
  EXPECT_EQ(statistics["photons"], report->photons);
  EXPECT_EQ(statistics["rays"], report->rays);
}

TEST(EmbeddedBake, GivesTheBytesOfTheBareKernels) {
  ExpectTheBytesOfTheBareKernels(SmallSettings());
  BakeSettings unfiltered = SmallSettings();
  unfiltered.filter = false;
  ExpectTheBytesOfTheBareKernels(unfiltered);
}

TEST(EmbeddedBake, GivesTheBytesOfTheBareKernelsAfterAPreviewOfTheLight) {
  BakeSettings settings = SmallSettings();
  settings.uv = UvMode::kGenerate;
  settings.density = DensityMode::kSignal;
  ExpectTheBytesOfTheBareKernels(settings);
}

// Fetches the result of a farm in `farm_folder` into `out_folder`. How many files were there before it fetched any.
size_t FetchFrom(const TempDir& farm_folder, const fs::path& out_folder) {
  SilentProgress progress;
  const auto submission = MakeSubmission(kSample, SmallSettings());
  const auto farm = EmbeddedFarm::Start(farm_folder / "farm", 2, "", progress);
  EXPECT_TRUE(submission.ok() && farm.ok()) << submission.status() << farm.status();
  FarmClient& client = (*farm)->client();
  const auto submitted = client.Submit(submission->scene_bytes, {"", "", submission->settings_bytes, true});
  EXPECT_TRUE(submitted.ok()) << submitted.status();
  const auto job = client.Watch(submitted->job_id(), [](const v1::Job&) { return true; });
  EXPECT_TRUE(job.ok() && job->state() == v1::DONE) << job.status();
  auto out = OutputDir::Create(out_folder);
  EXPECT_TRUE(out.ok()) << out.status();
  (*farm)->HandOver(*job, out->Staging());
  const size_t handed = NamesIn(out->Staging()).size();
  const auto manifest = FetchResult(client, *job, *submission, *out);
  EXPECT_TRUE(manifest.ok()) << manifest.status();
  EXPECT_TRUE(Conclude(*out, out_folder, *manifest).ok());
  return handed;
}

TEST(EmbeddedBake, GivesTheSameWhereFilesCannotBeLinked) {
  const TempDir disk, memory("/dev/shm");
  if (OnOneFileSystem(disk, memory)) GTEST_SKIP() << "/dev/shm and the folder for files that pass are one";
  EXPECT_GT(FetchFrom(disk, disk / "linked"), 5u);
  EXPECT_EQ(FetchFrom(memory, disk / "fetched"), 0u);
  const std::set<std::string> names = NamesIn(disk / "linked");
  EXPECT_EQ(NamesIn(disk / "fetched"), names);
  for (const std::string& name : names) {
    EXPECT_TRUE(BytesOf(disk / "linked" / name) == BytesOf(disk / "fetched" / name)) << name;
  }
}

TEST(EmbeddedBake, PhasesComeInOrderAndNothingElseIsLeftBehind) {
  const TempDir dir;
  struct Listener : Progress {
    std::mutex mutex;
    std::vector<std::string> seen;
    void Report(std::string_view phase, int64_t, int64_t) override {
      const std::lock_guard lock(mutex);
      if (seen.empty() || seen.back() != phase) seen.emplace_back(phase);
    }
  } progress;
  const auto summary = Bake({kSample, dir.path(), SmallSettings(), 1}, progress);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(progress.seen, (std::vector<std::string>{"chart", "texels", "photons", "density", "gather", "finish"}));
  const Json manifest = ManifestOf(dir.path());
  std::set<std::string> listed = {"manifest.json"};
  for (const Json& file : manifest["files"]) listed.insert(file["name"].get<std::string>());
  EXPECT_EQ(NamesIn(dir.path()), listed);
  std::vector<std::string> timed;
  for (const PhaseTime& phase : summary->phases) timed.push_back(phase.phase);
  EXPECT_EQ(timed,
            (std::vector<std::string>{"load", "chart", "texels", "photons", "density", "gather", "finish", "write"}));
  EXPECT_GT(manifest["task_versions"].size(), 5u);
  EXPECT_GT(summary->peak_memory_bytes, 10 << 20);
}

TEST(EmbeddedBake, CancelledBakeLeavesTheFolderAsItWas) {
  const TempDir dir;
  struct Impatient : Progress {
    std::chrono::steady_clock::time_point since;
    void Report(std::string_view phase, int64_t, int64_t) override {
      if (phase != "gather" || Cancelled()) return;
      since = std::chrono::steady_clock::now();
      Cancel();
    }
  } progress;
  BakeSettings settings = SmallSettings();
  settings.quality = Quality::kHigh;
  settings.resolution = 256;
  settings.photons = 1 << 20;  // the gather begins soon
  EXPECT_EQ(Bake({kSample, dir.path() / "out", settings, 2}, progress).status().code(), absl::StatusCode::kCancelled);
  // The gather takes half a minute.
  EXPECT_LT(std::chrono::steady_clock::now() - progress.since, kSlowness * std::chrono::seconds(5));
  EXPECT_TRUE(NamesIn(dir.path()).empty());
}

TEST(EmbeddedBake, SceneWithoutTexelsIsTheUsersErrorAndNamed) {
  const TempDir dir;
  GltfBuilder builder = QuadGltf();
  builder.json["nodes"][0]["extras"]["lightmapped"] = false;
  const fs::path scene = builder.Write(dir.path() / "dark.glb");
  const Outcome run = RunWith({"bake", scene.string(), "-o", (dir.path() / "out").string()});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find(scene.string() + ": no lightmapped surface"), std::string::npos) << run.err;
  EXPECT_FALSE(fs::exists(dir.path() / "out"));
}

// Symptom: the manifests of the two had times in them, so the folders were never the same.
TEST(SubmitWait, GivesWhatBakeGivesByteForByte) {
  const TempDir dir;
  const LevelFarm farm(2);
  const std::string baked = dir.path() / "baked", fetched = dir.path() / "fetched";
  const std::vector<std::string> flags = {"--quality", "preview",       "--resolution",
                                          "64",        "--environment", "constant:0.1,0.2,0.3"};
  std::vector<std::string> bake = {"bake", kSample, "-o", baked};
  std::vector<std::string> submit = {"submit", kSample, "--wait", "--server", farm.address(), "-o", fetched, "--json"};
  bake.insert(bake.end(), flags.begin(), flags.end());
  submit.insert(submit.end(), flags.begin(), flags.end());
  const Outcome one = RunWith(bake), other = RunWith(submit);
  ASSERT_EQ(one.exit_code, 0) << one.err;
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_EQ(NamesIn(fetched), NamesIn(baked));
  EXPECT_TRUE(NamesIn(baked).contains("manifest.json"));
  for (const std::string& name : NamesIn(baked)) {
    EXPECT_TRUE(BytesOf(fs::path(baked) / name) == BytesOf(fs::path(fetched) / name)) << name;
  }
  const size_t last_line = other.out.rfind('\n', other.out.size() - 2);
  const Json done = Json::parse(other.out.substr(last_line == std::string::npos ? 0 : last_line + 1));
  EXPECT_EQ(done["event"], "done");
  EXPECT_GT(done["cpu_seconds"], 0);
  const Json& phases = done["phases"];
  ASSERT_EQ(phases.size(), 6u);
  EXPECT_EQ(phases[4]["phase"], "gather");
  EXPECT_GT(phases[4]["cpu_seconds"], 0);
  EXPECT_GT(phases[4]["wall_seconds"], 0);
}

TEST(SubmitWait, FailedJobHasTheExitCodeAndTheReasonOfBake) {
  const TempDir dir;
  const LevelFarm farm(1);
  GltfBuilder builder = QuadGltf();
  builder.json["nodes"][0]["extras"]["lightmapped"] = false;
  const fs::path scene = builder.Write(dir.path() / "dark.glb");
  const Outcome run =
      RunWith({"submit", scene.string(), "--wait", "--server", farm.address(), "-o", (dir.path() / "out").string()});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_NE(run.err.find(scene.string() + ": no lightmapped surface"), std::string::npos) << run.err;
}

// The numbers of the jobs that `bakewell list` shows.
std::vector<int64_t> JobsListed(const LevelFarm& farm, std::vector<std::string> words) {
  words.insert(words.begin(), "list");
  words.insert(words.end(), {"--json", "--server", farm.address()});
  const Outcome run = RunWith(words);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  std::istringstream lines(run.out);
  std::vector<int64_t> jobs;
  for (std::string line; std::getline(lines, line);) jobs.push_back(Json::parse(line)["job"]);
  return jobs;
}

TEST(ListCommand, ShowsTheJobsOfAStateOrAUserNewestFirst) {
  const LevelFarm farm(0);
  std::vector<int64_t> jobs;
  for (int i = 0; i < 3; ++i) {
    const Outcome run = RunWith({"submit", kSample, "--server", farm.address(), "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    jobs.push_back(Json::parse(run.out)["job"]);
  }
  ASSERT_EQ(RunWith({"cancel", std::to_string(jobs[1]), "--server", farm.address()}).exit_code, 0);
  using Ids = std::vector<int64_t>;
  EXPECT_EQ(JobsListed(farm, {}), (Ids{jobs[2], jobs[1], jobs[0]}));
  EXPECT_EQ(JobsListed(farm, {"--state", "running"}), (Ids{jobs[2], jobs[0]}));
  EXPECT_EQ(JobsListed(farm, {"--state", "cancelled"}), Ids{jobs[1]});
  EXPECT_EQ(JobsListed(farm, {"--state", "done"}), Ids{});
  EXPECT_EQ(JobsListed(farm, {"--user", "nobody"}), Ids{});
  EXPECT_EQ(JobsListed(farm, {"--state", "running", "--limit", "1"}), Ids{jobs[2]});
  EXPECT_EQ(RunWith({"list", "--state", "asleep", "--server", farm.address()}).exit_code, 2);
}

TEST(AdminCommand, DoesWhatAnOperatorDoes) {
  const TempDir dir;
  LevelFarm farm(1);
  const auto admin = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "admin");
    words.insert(words.end(), {"--server", farm.address()});
    return RunWith(words);
  };
  Outcome run = admin({"status", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(Json::parse(run.out)["running_jobs"], 0);
  EXPECT_EQ(admin({"quota", "local", "--max-jobs", "1"}).exit_code, 0);
  EXPECT_EQ(admin({"quota", "local", "--weight", "0"}).exit_code, 2);
  EXPECT_EQ(admin({"priority", "99", "7"}).exit_code, 2);
  const std::vector<std::string> submit = {"submit", kSample, "--server", farm.address(), "--json"};
  run = RunWith(submit);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const int64_t job = Json::parse(run.out)["job"];
  EXPECT_EQ(RunWith(submit).exit_code, 1) << "the quota is one job";
  EXPECT_EQ(admin({"priority", std::to_string(job), "7"}).exit_code, 0);
  FarmClient client(farm.Connect());
  EXPECT_EQ(client.Get(job)->priority(), 7);
  EXPECT_TRUE(client.Cancel(job).ok());
  EXPECT_NE(admin({"gc", "--target", "0", "--grace", "0.000001"}).out.find("results forgotten"), std::string::npos);
  const auto workers = client.Workers();
  ASSERT_TRUE(workers.ok()) << workers.status();
  for (const v1::WorkerState& worker : workers->workers()) {
    if (worker.name() != "w0") continue;
    EXPECT_EQ(admin({"drain", std::to_string(worker.id())}).exit_code, 0);
  }
  EXPECT_EQ(admin({"drain", "1"}).exit_code, 2);
  EXPECT_EQ(admin({}).exit_code, 2);
}

}  // namespace
}  // namespace bakewell::test
