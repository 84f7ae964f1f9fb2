#include <absl/strings/str_format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <numeric>

#include "client/local/phase_clock.h"
#include "core/atlas/serialize.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "worker/gather/accumulate.h"
#include "worker/level/executor.h"
#include "worker/texel/sampler.h"

// bench_memory [--pages 16 --side 2048 --triangles 10000000 --finish 2]: what a worker needs for a large level. Runs
// the tasks of a bake as a worker does, one after the other, and prints the peak of resident memory within each kind.
namespace bakewell {
namespace {

constexpr float kTexelsPerMetre = 8;
constexpr int kGutter = 4, kLampsPerPage = 4, kTilesPerTask = 64;

struct LevelSize {
  int pages = 16, side = 2048, finish = 2, threads = 2;
  int64_t triangles = 10'000'000, photons = 20'000'000;
};

// Rolling ground of the district that a page shows: steep enough to light itself.
float HeightAt(float x, float z) {
  return 1.5f * std::sin(0.7f * x) * std::cos(0.6f * z) + 0.5f * std::sin(2.3f * x + 1.1f * z);
}

Object DistrictOf(int page, int across, int quads, float size_m) {
  Object object;
  const float x0 = static_cast<float>(page % across) * size_m, z0 = static_cast<float>(page / across) * size_m;
  for (int k = 0; k <= quads; ++k) {
    for (int i = 0; i <= quads; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(quads);
      const float t = static_cast<float>(k) / static_cast<float>(quads);
      const float x = x0 + s * size_m, z = z0 + t * size_m;
      object.position.push_back({x, HeightAt(x, z), z});
      object.normal.push_back({0, 1, 0});
      object.uv1.push_back({s, t});
    }
  }
  for (int k = 0; k < quads; ++k) {
    for (int i = 0; i < quads; ++i) {
      const uint32_t a = static_cast<uint32_t>(k * (quads + 1) + i), below = a + static_cast<uint32_t>(quads) + 1;
      for (const uint32_t corner : {a, below, below + 1, a, below + 1, a + 1}) object.index.push_back(corner);
    }
  }
  object.uv0.resize(object.position.size());
  return object;
}

ObjectCharts ChartOf(const Object& object, int chart, int side) {
  ObjectCharts charts;
  for (uint32_t i = 0; i < object.position.size(); ++i) charts.xref.push_back(i);
  const float inner = static_cast<float>(side - 2 * kGutter);
  for (const Vec2f uv : object.uv1) charts.uv.push_back({kGutter + uv.x * inner, kGutter + uv.y * inner});
  charts.index = object.index;
  charts.chart_of_triangle.assign(object.index.size() / 3, chart);
  return charts;
}

struct Bytes {
  Blob scene, layout;
};

Bytes MakeLevel(const LevelSize& size) {
  Scene scene;
  AtlasLayout layout;
  const int across = static_cast<int>(std::ceil(std::sqrt(size.pages)));
  const int quads = static_cast<int>(std::sqrt(static_cast<double>(size.triangles) / size.pages / 2));
  const float size_m = static_cast<float>(size.side) / kTexelsPerMetre;
  scene.materials.emplace_back().base_color = {0.5f, 0.48f, 0.45f};
  for (int page = 0; page < size.pages; ++page) {
    scene.objects.push_back(DistrictOf(page, across, quads, size_m));
    layout.pages.push_back({size.side, size.side});
    layout.charts.push_back({page, page});
    layout.objects.push_back(ChartOf(scene.objects.back(), page, size.side));
    for (int i = 0; i < kLampsPerPage; ++i) {
      const float x = (static_cast<float>(page % across) + 0.2f + 0.2f * static_cast<float>(i)) * size_m;
      const float z = (static_cast<float>(page / across) + 0.5f) * size_m;
      PunctualLight& lamp = scene.lights.emplace_back();
      lamp.intensity = {200, 180, 150};
      lamp.position = {x, 8, z};
    }
  }
  layout.texels_per_metre = kTexelsPerMetre;
  PunctualLight& sun = scene.lights.emplace_back();
  sun.type = LightType::kDirectional;
  sun.intensity = {4, 3.8f, 3.5f};
  sun.direction = NormalizeOrZero(Vec3f{-0.5f, -0.7f, -0.4f});
  sun.tangent = NormalizeOrZero(Cross(sun.direction, Vec3f{0, 1, 0}));
  sun.angular_diameter_rad = 0.00925f;
  scene.environment.type = EnvironmentType::kConstant;
  scene.environment.radiance = {0.6f, 0.8f, 1};
  const std::vector<std::byte> bytes = SerializeScene(scene);
  return {std::make_shared<const std::string>(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
          std::make_shared<const std::string>(SerializeLayout(layout))};
}

// Resident megabytes: VmRSS, or VmHWM, the peak since the last ResetPeak().
double Resident(const std::string& what) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(what)) return std::stod(line.substr(what.size() + 1)) / 1024;
  }
  return 0;
}

void ResetPeak() { std::ofstream("/proc/self/clear_refs") << "5"; }

class Bench {
 public:
  Bench(const LevelSize& size, Bytes level)
      : size_(size), executor_({.threads = size.threads}), level_(std::move(level)) {
    settings_.quality = Quality::kPreview;
    settings_.min_samples = settings_.max_samples = 8;
    settings_.photons = size.photons;
    inputs_ = {{"scene", level_.scene}, {"layout", level_.layout}};
    for (const auto& [name, blob] : inputs_) digests_.push_back({name, Sha256Of(*blob)});
  }

  absl::Status Run() {
    BAKEWELL_ASSIGN_OR_RETURN(MadeOutputs made, Task(level_task::kSurvey, 0, 0, {}));
    BAKEWELL_ASSIGN_OR_RETURN(const level_task::Survey survey, level_task::ParseSurvey(made[0].bytes));
    BAKEWELL_ASSIGN_OR_RETURN(made, Task(level_task::kEmit, 0, 1, {}));
    BAKEWELL_ASSIGN_OR_RETURN(made, Task(level_task::kDensity, 0, 0, {{"flux0", Share(made[0])}}));
    const Blob cache = Share(made[0]);
    made.clear();
    std::cout << absl::StrFormat("texels %d, cache %.1f bytes a texel as stored\n", survey.texels,
                                 static_cast<double>(cache->size()) / static_cast<double>(survey.texels));
    for (int page = 0; page < std::min(size_.finish, size_.pages); ++page) {
      const uint32_t begin = page == 0 ? 0 : survey.tile_end_of_page[static_cast<size_t>(page) - 1];
      const uint32_t end = survey.tile_end_of_page[static_cast<size_t>(page)];
      TaskInputs lights;
      for (uint32_t tile = begin; tile < end; tile += kTilesPerTask) {
        BAKEWELL_ASSIGN_OR_RETURN(Blob some, Gathered(survey, tile, std::min(end, tile + kTilesPerTask), cache));
        lights.push_back({absl::StrFormat("lights%d", lights.size()), std::move(some)});
      }
      Print("gather/tiles");
      std::cout << absl::StrFormat("page %d: results of its tiles %.0f MB\n", page, Megabytes(lights));
      BAKEWELL_ASSIGN_OR_RETURN(made, Task(level_task::kFinish, static_cast<uint32_t>(page), begin, lights));
      made.clear();
    }
    return absl::OkStatus();
  }

 private:
  // The result of a gather task. A page has thousands of tasks that need the same: one for every number of texels is
  // run, the others get copies of its bytes, which take as much memory.
  absl::StatusOr<Blob> Gathered(const level_task::Survey& survey, uint32_t begin, uint32_t end, const Blob& cache) {
    const auto first = survey.texels_of_tile.begin();
    const uint32_t texels = std::accumulate(first + begin, first + end, 0u);
    std::string& bytes = gathered_[texels];
    if (bytes.empty()) {
      BAKEWELL_ASSIGN_OR_RETURN(MadeOutputs made, Task(level_task::kGather, begin, end, {{"cache", cache}}));
      bytes = std::move(made.back().bytes);
    }
    return std::make_shared<const std::string>(bytes);
  }

  static Blob Share(MadeOutput& output) { return std::make_shared<const std::string>(std::move(output.bytes)); }

  static double Megabytes(const TaskInputs& inputs) {
    double sum = 0;
    for (const auto& [name, blob] : inputs) sum += static_cast<double>(blob->size());
    return sum / 1048576;
  }

  absl::StatusOr<MadeOutputs> Task(const level_task::KindName& kind, uint32_t begin, uint32_t end,
                                   const TaskInputs& more) {
    TaskSpec spec{kind.kind, kind.code_version, level_task::Serialize({SettingsJson(settings_), begin, end}), {}};
    for (const auto& [name, digest] : digests_) spec.inputs.push_back({name, digest});
    for (const auto& [name, blob] : more) spec.inputs.push_back({name, Digest{}});
    TaskInputs inputs = inputs_;
    inputs.insert(inputs.end(), more.begin(), more.end());
    auto made = executor_.Run(spec, inputs, {});
    if (std::string_view(kind.kind) != level_task::kGather.kind) Print(kind.kind);
    return made;
  }

  void Print(std::string_view kind) {
    const double cpu = PhaseClock::CpuSeconds();
    std::cout << absl::StrFormat("| %s | %.0f | %.0f | %.1f |\n", kind, Resident("VmHWM"), Resident("VmRSS"),
                                 cpu - cpu_)
              << std::flush;
    cpu_ = cpu;
    ResetPeak();
  }

  const LevelSize size_;
  LevelExecutor executor_;
  const Bytes level_;
  BakeSettings settings_;
  TaskInputs inputs_;
  std::vector<std::pair<std::string, Digest>> digests_;
  std::map<uint32_t, std::string> gathered_;  // by number of texels
  double cpu_ = PhaseClock::CpuSeconds();
};

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  CLI::App app("What a worker needs for a large level.");
  bakewell::LevelSize size;
  app.add_option("--pages", size.pages);
  app.add_option("--side", size.side);
  app.add_option("--triangles", size.triangles);
  app.add_option("--photons", size.photons);
  app.add_option("--finish", size.finish, "pages whose gather and finish tasks are run");
  app.add_option("--threads", size.threads);
  CLI11_PARSE(app, argc, argv);
  bakewell::Bytes level = bakewell::MakeLevel(size);
  std::cout << absl::StrFormat(
      "bytes: Texel %d, TexelLight %d, Accumulator %d, TexelSampler %d; scene %.0f MB, layout %.0f MB\n",
      sizeof(bakewell::Texel), sizeof(bakewell::TexelLight), sizeof(bakewell::Accumulator),
      sizeof(bakewell::TexelSampler), static_cast<double>(level.scene->size()) / 1048576,
      static_cast<double>(level.layout->size()) / 1048576);
  std::cout << "| task | peak MB | after it MB | CPU s |\n|---|---|---|---|\n";
  bakewell::ResetPeak();
  bakewell::Bench bench(size, std::move(level));
  const absl::Status status = bench.Run();
  if (!status.ok()) std::cerr << status << "\n";
  return status.ok() ? 0 : 1;
}
