#include "client/cli/cli.h"

#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/artifact/atomic_file.h"
#include "core/image/exr.h"
#include "core/image/png.h"
#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

using Json = nlohmann::json;

// What a run of the command line did. The bakers keep what they were asked for and answer `answer`.
struct Outcome {
  int exit_code = 0;
  std::string out, err;
  std::optional<BakeRequest> bake;
  std::optional<ReferenceRequest> reference;
};

BakeSummary TwoFiles() {
  BakeSummary summary;
  summary.output_dir = "out";
  summary.files = {"out/lightmap-0.irradiance.exr", "out/manifest.json"};
  summary.warnings = {"no normals"};
  summary.estimated_error = 0.008;
  summary.rays = 2500000;
  summary.phases = {{"chart", 1, 2}, {"gather", 3, 5}};
  summary.peak_memory_bytes = 4096;
  return summary;
}

Outcome RunWith(std::vector<const char*> words, const absl::StatusOr<BakeSummary>& answer = TwoFiles()) {
  words.insert(words.begin(), "bakewell");
  Outcome run;
  std::ostringstream out, err;
  const Bakers bakers{[&](const BakeRequest& request, Progress& progress) {
                        progress.Report("gather", 1, 2);
                        run.bake = request;
                        return answer;
                      },
                      [&](const ReferenceRequest& request, Progress&) {
                        run.reference = request;
                        return answer;
                      }};
  run.exit_code = RunCli(static_cast<int>(words.size()), words.data(), {out, err}, bakers);
  run.out = out.str();
  run.err = err.str();
  return run;
}

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(CliBake, EveryFlagReachesTheRequest) {
  const Outcome run = RunWith({"bake",
                               "a.glb",
                               "-o",
                               "there",
                               "--uv",
                               "generate",
                               "--density",
                               "signal",
                               "--resolution",
                               "256",
                               "--texels-per-metre",
                               "7.5",
                               "--quality",
                               "high",
                               "--target-error",
                               "0.02",
                               "--photons",
                               "3000000000",
                               "--photon-batches",
                               "64",
                               "--samples",
                               "1024",
                               "--backfaces",
                               "absorb",
                               "--environment",
                               "gradient:1,2,3/4,5,6/7,8,9",
                               "--albedo-limit",
                               "0.9",
                               "--seed",
                               "7",
                               "--threads",
                               "2"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_TRUE(run.bake.has_value());
  EXPECT_EQ(run.bake->scene_path, "a.glb");
  EXPECT_EQ(run.bake->output_dir, "there");
  EXPECT_EQ(run.bake->threads, 2);
  const BakeSettings& settings = run.bake->settings;
  EXPECT_EQ(settings.uv, UvMode::kGenerate);
  EXPECT_EQ(settings.density, DensityMode::kSignal);
  EXPECT_EQ(settings.resolution, 256);
  EXPECT_EQ(settings.texels_per_metre, 7.5f);
  EXPECT_EQ(settings.quality, Quality::kHigh);
  EXPECT_EQ(settings.target_error, 0.02f);
  EXPECT_EQ(settings.photons, 3000000000);
  EXPECT_EQ(settings.photon_batches, 64);
  EXPECT_EQ(settings.max_samples, 1024);
  EXPECT_EQ(settings.backfaces, BackfaceMode::kAbsorb);
  EXPECT_EQ(settings.albedo_limit, 0.9f);
  EXPECT_EQ(settings.seed, 7u);
  ASSERT_TRUE(settings.environment.has_value());
  EXPECT_EQ(settings.environment->type, EnvironmentType::kGradient);
  EXPECT_EQ(settings.environment->horizon.z, 6);
}

TEST(CliBake, FlagsOverrideTheSettingsFile) {
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "s.json", R"({"quality":"HIGH","seed":3})").ok());
  const std::string file = folder / "s.json";
  const Outcome run = RunWith({"bake", "a.glb", "--settings", file.c_str(), "--seed", "4"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.bake->settings.quality, Quality::kHigh);
  EXPECT_EQ(run.bake->settings.seed, 4u);
  EXPECT_EQ(run.bake->output_dir, "out");
}

TEST(CliBake, APictureInTheSettingsFileIsFoundBesideIt) {
  const TempDir folder;
  Image sky(2, 1, {"R", "G", "B"});
  sky.data = {1, 2, 3, 4, 5, 6};
  ASSERT_TRUE(WriteExr(folder / "sky.exr", sky).ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "s.json", R"({"environment":{"lat_long":{"file":"sky.exr"}}})").ok());
  const std::string file = folder / "s.json";
  const Outcome run = RunWith({"bake", "a.glb", "--settings", file.c_str()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.bake->settings.environment->latlong[1].y, 4);
}

TEST(CliBake, UserErrorsExitWithTwoAndSayWhat) {
  const std::vector<std::pair<std::vector<const char*>, const char*>> cases = {
      {{"bake"}, "scene is required"},
      {{"bake", "a.glb", "--frob"}, "--frob"},
      {{"bake", "a.glb", "--resolution", "abc"}, "--resolution"},
      {{"bake", "a.glb", "--resolution", "-1"}, "resolution must be 4 to 16384 texels, or 0, not -1"},
      {{"bake", "a.glb", "--samples", "100"}, "power of two"},
      {{"bake", "a.glb", "--quality", "ultra"}, "ultra"},
      {{"bake", "a.glb", "--seed", "-1"}, "--seed"},
      {{"bake", "a.glb", "--threads", "-2"}, "--threads must be 0 to 1024, not -2"},
      {{"bake", "a.glb", "--environment", "constant:1,2"}, "--environment constant:1,2 is none of"},
      {{"bake", "a.glb", "--environment", "constant:1,2,-3"}, "not negative"},
      {{"bake", "a.glb", "--environment", "/nonexistent/sky.exr"}, "/nonexistent/sky.exr"},
      {{"bake", "a.glb", "--settings", "/nonexistent.json"}, "no such file: /nonexistent.json"},
      {{"reference", "a.glb", "--spp", "0"}, "--spp must be 1 to 16777216, not 0"},
      {{"frobnicate"}, "frobnicate"},
      {{}, "subcommand"}};
  for (const auto& [words, message] : cases) {
    const Outcome run = RunWith(words);
    EXPECT_EQ(run.exit_code, 2) << message;
    EXPECT_TRUE(Has(run.err, message)) << run.err << " has not: " << message;
    EXPECT_FALSE(run.bake.has_value() || run.reference.has_value()) << message;
  }
}

TEST(CliBake, ExitCodeFollowsTheStatusCode) {
  const auto exit_code = [](const absl::Status& status) { return RunWith({"bake", "a.glb"}, status).exit_code; };
  EXPECT_EQ(exit_code(absl::InvalidArgumentError("scene")), 2);
  EXPECT_EQ(exit_code(absl::NotFoundError("scene")), 2);
  EXPECT_EQ(exit_code(absl::UnavailableError("disk")), 1);
  EXPECT_EQ(exit_code(absl::InternalError("bug")), 1);
  EXPECT_EQ(exit_code(absl::CancelledError("Ctrl-C")), 130);
}

TEST(CliBake, TextNamesFilesErrorAndWarnings) {
  const Outcome run = RunWith({"bake", "a.glb"});
  EXPECT_TRUE(Has(run.out, "2.50 million rays, estimated error 0.80 %\n")) << run.out;
  EXPECT_TRUE(Has(run.out, "out/lightmap-0.irradiance.exr\n"));
  EXPECT_TRUE(Has(run.err, "warning: no normals\n"));
  EXPECT_TRUE(Has(run.err, "gather")) << "progress goes to the error stream";
}

TEST(CliBake, JsonIsOneObjectALineAndNothingElse) {
  const Outcome run = RunWith({"bake", "a.glb", "--json"});
  EXPECT_EQ(run.err, "");
  std::istringstream lines(run.out);
  std::vector<Json> objects;
  for (std::string line; std::getline(lines, line);) objects.push_back(Json::parse(line));
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_EQ(objects[0]["event"], "progress");
  EXPECT_EQ(objects[0]["phase"], "gather");
  EXPECT_EQ(objects[1]["event"], "done");
  EXPECT_EQ(objects[1]["files"].size(), 2u);
  EXPECT_EQ(objects[1]["warnings"][0], "no normals");

  const Outcome failed = RunWith({"bake", "a.glb", "--json"}, absl::UnavailableError("disk"));
  EXPECT_TRUE(Has(failed.out, R"({"event":"error","code":"UNAVAILABLE","message":"disk"})")) << failed.out;
}

TEST(CliBake, TheFirstInterruptCancels) {
  std::ostringstream out, err;
  const char* const words[] = {"bakewell", "bake", "a.glb"};
  const Bakers bakers{[](const BakeRequest&, Progress& progress) -> absl::StatusOr<BakeSummary> {
                        EXPECT_FALSE(progress.Cancelled());
                        std::raise(SIGINT);
                        EXPECT_TRUE(progress.Cancelled());
                        return absl::CancelledError("interrupted");
                      },
                      {}};
  EXPECT_EQ(RunCli(3, words, {out, err}, bakers), 130);
  EXPECT_EQ(err.str(), "bakewell: interrupted\n");
}

TEST(CliBakeDeathTest, TheSecondInterruptEndsTheProcess) {
  const char* const words[] = {"bakewell", "bake", "a.glb"};
  const Bakers bakers{[](const BakeRequest&, Progress&) -> absl::StatusOr<BakeSummary> {
                        std::raise(SIGTERM);
                        std::raise(SIGINT);
                        return absl::InternalError("still here");
                      },
                      {}};
  std::ostringstream out;
  EXPECT_EXIT(RunCli(3, words, {out, out}, bakers), testing::ExitedWithCode(130), "");
}

TEST(CliReference, PathsReachTheRequest) {
  const Outcome run = RunWith({"reference", "a.glb", "--spp", "4096", "--resolution", "64"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.reference->spp, 4096);
  EXPECT_EQ(run.reference->settings.resolution, 64);
  EXPECT_EQ(RunWith({"reference", "a.glb", "--photons", "5"}).exit_code, 2) << "it has no photons";
}

TEST(Cli, HelpHasExamplesAndExitsWithZero) {
  for (const char* const command : {"bake", "reference", "compare"}) {
    const Outcome run = RunWith({command, "--help"});
    EXPECT_EQ(run.exit_code, 0);
    EXPECT_TRUE(Has(run.out, std::string("bakewell ") + command)) << run.out;
  }
  EXPECT_EQ(RunWith({"--version"}).out, "0.1.0\n");
}

// Two 2 x 2 images that differ in one covered texel.
struct ComparedFiles {
  TempDir folder;
  std::string a = folder / "a.exr", b = folder / "b.exr", picture = folder / "d.png";

  ComparedFiles() {
    Image image(2, 2, {"R", "G", "B", "A"});
    std::fill(image.data.begin(), image.data.end(), 1.0f);
    image.At(3, 1, 1) = 0;  // uncovered
    EXPECT_TRUE(WriteExr(b, image).ok());
    for (int c = 0; c < 3; ++c) image.At(c, 1, 0) = 1.3f, image.At(c, 1, 1) = 100;
    EXPECT_TRUE(WriteExr(a, image).ok());
  }
};

TEST(CliCompare, WithoutAMaskCoveredTexelsCount) {
  const ComparedFiles files;
  const Outcome run = RunWith({"compare", files.a.c_str(), files.b.c_str(), "--json", "--out", files.picture.c_str()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json json = Json::parse(run.out);
  EXPECT_EQ(json["texels"], 3);
  EXPECT_NEAR(json["bias"], 0.1, 1e-6);
  EXPECT_NEAR(json["relRMSE"], 0.3 / std::sqrt(3.0), 1e-6);
  EXPECT_FALSE(json.contains("relRMSE_cross"));
  EXPECT_EQ(ReadPng(files.picture)->width, 2);
}

TEST(CliCompare, TextHasOneFigureALine) {
  const ComparedFiles files;
  const Outcome run =
      RunWith({"compare", files.a.c_str(), files.b.c_str(), "--halves", files.b.c_str(), files.b.c_str()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(Has(run.out, "bias                 10.0000 %\n")) << run.out;
  EXPECT_TRUE(Has(run.out, "relRMSE cross        17.3205 %\n")) << run.out;
}

TEST(CliCompare, UserErrorsExitWithTwoAndSayWhat) {
  const ComparedFiles files;
  const char *const a = files.a.c_str(), *const b = files.b.c_str();
  const std::vector<uint8_t> black(12, 0);
  const std::string mask = files.folder / "m.png";
  ASSERT_TRUE(WritePng(mask, 2, 2, black).ok());
  const std::vector<std::pair<std::vector<const char*>, const char*>> cases = {
      {{"compare", a}, "reference is required"},
      {{"compare", a, "/nonexistent.exr"}, "no such file: /nonexistent.exr"},
      {{"compare", a, b, "--mask", mask.c_str()}, "no texel is inside the mask"},
      {{"compare", a, b, "--mask", mask.c_str(), "--min-mask", "256"}, "--min-mask"},
      {{"compare", a, b, "--min-mask", "128"}, "--min-mask"},
      {{"compare", a, b, "--mask", a}, "not a readable PNG"},
      {{"compare", mask.c_str(), b}, "not a readable EXR"},
      {{"compare", a, b, "--halves", a}, "--halves"}};
  for (const auto& [words, message] : cases) {
    const Outcome run = RunWith(words);
    EXPECT_EQ(run.exit_code, 2) << message;
    EXPECT_TRUE(Has(run.err, message)) << run.err << " has not: " << message;
  }
}

}  // namespace
}  // namespace bakewell
