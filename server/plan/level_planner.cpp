#include "server/plan/level_planner.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

#include "core/artifact/level_task.h"
#include "core/scene/canonical.h"
#include "proto/bakewell/v1/settings.pb.h"
#include "proto/settings.h"

namespace bakewell::plan {

namespace {

using level_task::KindName;
using std::chrono::microseconds;

// Measured costs on one core of the build machine (tests/bench has the machine); the
// scheduler corrects them by what it sees.
constexpr double kPhotonUs = 1;
constexpr double kSampleUs = 2.5;
constexpr double kPilotUs = 100'000;
constexpr double kFinishUs = 500'000;
constexpr double kReportUs = 20'000;
constexpr int64_t kTaskBytes = int64_t{256} << 20;  // level, photons and cache of a middling scene

double SamplesOf(Quality quality) {
  switch (quality) {
    case Quality::kPreview:
      return 24;
    case Quality::kMedium:
      return 120;
    case Quality::kHigh:
      break;
  }
  return 900;
}

// What the planner knows when it makes a task.
struct Context {
  Digest scene;
  TaskKey chart;
  BakeSettings settings;
  double task_us;  // what a task should take
};

// The settings that a kind looks at; the others are defaults, so that they change no key.
std::string SettingsFor(const KindName& kind, BakeSettings settings) {
  settings.photon_batches = BakeSettings().photon_batches;
  const BakeSettings defaults;
  if (kind.kind == level_task::kChart.kind) {
    BakeSettings charts;
    charts.uv = settings.uv;
    charts.resolution = settings.resolution;
    charts.texels_per_metre = settings.texels_per_metre;
    return SettingsJson(charts);
  }
  settings.uv = defaults.uv;
  settings.resolution = defaults.resolution;
  settings.texels_per_metre = defaults.texels_per_metre;
  if (kind.kind == level_task::kReport.kind) {
    BakeSettings counted;
    counted.no_skip = settings.no_skip;
    return SettingsJson(counted);
  }
  if (kind.kind == level_task::kGather.kind) return SettingsJson(settings);
  const bool finishes = kind.kind == level_task::kFinish.kind, surveys = kind.kind == level_task::kSurvey.kind;
  if (finishes) {
    settings.photons = defaults.photons;
  } else {
    settings.filter = defaults.filter;
  }
  if (!finishes && !surveys) settings.target_error = defaults.target_error;
  settings.min_samples = defaults.min_samples;
  settings.max_samples = defaults.max_samples;
  return SettingsJson(settings);
}

PlannedTask MakeTask(const Context& context, const KindName& kind, uint32_t begin, uint32_t end, double cost_us) {
  PlannedTask task;
  task.spec.kind = kind.kind;
  task.spec.code_version = kind.code_version;
  task.spec.settings = level_task::Serialize({SettingsFor(kind, context.settings), begin, end});
  task.spec.inputs.push_back({"scene", context.scene});
  task.cost = microseconds(static_cast<int64_t>(std::max(1000.0, cost_us)));
  task.memory_bytes = kTaskBytes;
  return task;
}

void Need(PlannedTask& task, std::string name, const TaskKey& maker, const char* output) {
  task.spec.inputs.push_back({std::move(name), OutputOf{maker, output}});
}

TaskKey Add(TaskGraph& graph, PlannedTask task) {
  task.key = KeyOf(task.spec);
  graph.tasks.push_back(std::move(task));
  return graph.tasks.back().key;
}

// Tiles [begin, end) of one task.
struct TileGroup {
  uint32_t begin, end;
  double cost_us;
};

// Consecutive tiles of one page, together about `task_us`.
std::vector<TileGroup> GroupTiles(const level_task::Survey& survey, uint32_t begin, uint32_t end, double texel_us,
                                  double task_us) {
  std::vector<TileGroup> groups;
  for (uint32_t tile = begin; tile < end; ++tile) {
    const double cost_us = texel_us * survey.texels_of_tile[tile];
    if (groups.empty() || groups.back().cost_us + cost_us > task_us) groups.push_back({tile, tile, 0});
    groups.back().end = tile + 1;
    groups.back().cost_us += cost_us;
  }
  return groups;
}

// Whose outputs are the radiance cache and its totals.
TaskKey AddPhotons(const Context& context, const TaskKey& surveyor, const level_task::Survey& survey,
                   TaskGraph& graph) {
  if (survey.has_cache) return surveyor;
  const double cost_us = kPhotonUs * static_cast<double>(survey.photons);
  const uint32_t batches = static_cast<uint32_t>(std::clamp(cost_us / context.task_us, 1.0, 256.0));
  std::vector<TaskKey> makers;
  for (uint32_t batch = 0; batch < batches; ++batch) {
    PlannedTask task = MakeTask(context, level_task::kEmit, batch, batches, cost_us / batches);
    Need(task, "layout", context.chart, "layout");
    makers.push_back(Add(graph, std::move(task)));
  }
  PlannedTask density = MakeTask(context, level_task::kDensity, 0, 0, cost_us / 4);
  Need(density, "layout", context.chart, "layout");
  for (size_t i = 0; i < makers.size(); ++i) Need(density, absl::StrCat("flux", i), makers[i], "flux");
  return Add(graph, std::move(density));
}

// The tasks of one page: its tiles, and the page itself, whose key it returns.
TaskKey AddPage(const Context& context, const std::vector<TileGroup>& groups, uint32_t page, uint32_t first_tile,
                const TaskKey& cache, TaskGraph& graph) {
  std::vector<TaskKey> makers;
  for (const TileGroup& group : groups) {
    PlannedTask task = MakeTask(context, level_task::kGather, group.begin, group.end, group.cost_us);
    Need(task, "layout", context.chart, "layout");
    Need(task, "cache", cache, "cache");
    makers.push_back(Add(graph, std::move(task)));
  }
  PlannedTask finish = MakeTask(context, level_task::kFinish, page, first_tile, kFinishUs);
  Need(finish, "layout", context.chart, "layout");
  for (size_t i = 0; i < makers.size(); ++i) Need(finish, absl::StrCat("lights", i), makers[i], "lights");
  const TaskKey key = Add(graph, std::move(finish));
  for (const level_task::PageFile& file : level_task::kPageFiles) {
    const std::string name = absl::StrCat("lightmap-", page, file.ending);
    graph.artifacts.push_back({name, {key, name}});
  }
  return key;
}

// Area of what gets a lightmap [m^2].
double LightmappedArea(const Scene& scene) {
  double area = 0;
  for (const Object& object : scene.objects) {
    if (!object.lightmapped) continue;
    for (size_t i = 0; i + 2 < object.index.size(); i += 3) {
      const Vec3f a = object.position[object.index[i]], b = object.position[object.index[i + 1]],
                  c = object.position[object.index[i + 2]];
      area += Length(Cross(ToDouble(b - a), ToDouble(c - a))) / 2;
    }
  }
  return area;
}

// A page side or a density that asks for more texels than workers have memory for.
absl::Status CheckTexels(const Scene& scene, const BakeSettings& settings, double max_texels) {
  const double side = settings.resolution, density = static_cast<double>(settings.texels_per_metre);
  const double texels = side > 0 ? side * side : density * density * LightmappedArea(scene);
  if (texels <= max_texels) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrFormat(
      "the settings ask for %.3g texels; %.3g are allowed: lower the resolution or the texels per metre", texels,
      max_texels));
}

absl::Status CheckSurvey(const level_task::Survey& survey) {
  uint32_t last = 0;
  for (const uint32_t end : survey.tile_end_of_page) {
    if (end < last || end > survey.texels_of_tile.size()) return absl::DataLossError("the texel survey is broken");
    last = end;
  }
  return absl::OkStatus();
}

absl::StatusOr<level_task::Survey> SurveyFrom(const TaskOutputs& done, const BlobReader& read) {
  const auto made = [&](const char* name) {
    return std::find_if(done.begin(), done.end(), [&](const TaskOutput& output) { return output.name == name; });
  };
  if (made("survey") == done.end()) return absl::InternalError("the texel survey has no result");
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, read(made("survey")->digest));
  BAKEWELL_ASSIGN_OR_RETURN(level_task::Survey survey, level_task::ParseSurvey(bytes));
  BAKEWELL_RETURN_IF_ERROR(CheckSurvey(survey));
  if (survey.has_cache && (made("cache") == done.end() || made("totals") == done.end())) {
    return absl::InternalError("the texel survey did not hand in its radiance cache");
  }
  return survey;
}

}  // namespace

absl::StatusOr<BakeSettings> ReadSettings(const std::string& bytes) {
  v1::BakeSettings message;
  if (!message.ParseFromString(bytes)) return absl::InvalidArgumentError("settings: not a BakeSettings message");
  if (!message.GetReflection()->GetUnknownFields(message).empty()) {
    return absl::InvalidArgumentError("settings: some are not known to this coordinator: is the client newer?");
  }
  if (message.has_environment()) {
    return absl::InvalidArgumentError("settings: the environment belongs into the scene that is submitted");
  }
  if (message.density() == v1::BakeSettings::SIGNAL) {
    return absl::InvalidArgumentError(
        "settings: density SIGNAL needs a preview before the charts, which a farm does not plan: bake it with "
        "`bakewell bake`, or submit with density UNIFORM");
  }
  return SettingsFromProto(message, [](const std::string&) -> absl::StatusOr<Environment> {
    return absl::InvalidArgumentError("settings: a coordinator reads no files");
  });
}

std::vector<Kind> LevelPlanner::Kinds() const {
  std::vector<Kind> kinds;
  for (const KindName& name : level_task::kAll) {
    kinds.push_back({name.kind, name.code_version});
  }
  return kinds;
}

absl::StatusOr<TaskGraph> LevelPlanner::Plan(const PlanRequest& request, const BlobReader& read) const {
  Context context{request.scene, {}, {}, TaskUs()};
  BAKEWELL_ASSIGN_OR_RETURN(context.settings, ReadSettings(request.settings));
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, read(request.scene));
  const auto scene = ParseScene(std::as_bytes(std::span(bytes)));
  if (!scene.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("the scene is malformed: ", scene.status().message()));
  }
  double triangles = 0;
  for (const Object& object : scene->objects) triangles += static_cast<double>(object.index.size()) / 3;
  if (triangles > limits_.max_triangles) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "the scene has %.3g triangles; %.3g are allowed: split the level", triangles, limits_.max_triangles));
  }
  BAKEWELL_RETURN_IF_ERROR(CheckTexels(*scene, context.settings, limits_.max_texels));
  TaskGraph graph;
  context.chart = Add(graph, MakeTask(context, level_task::kChart, 0, 0, 50 * triangles));
  PlannedTask survey = MakeTask(context, level_task::kSurvey, 0, 0, kPilotUs + 20 * triangles);
  Need(survey, "layout", context.chart, "layout");
  graph.next_stage_after = Add(graph, std::move(survey));
  return graph;
}

absl::StatusOr<TaskGraph> LevelPlanner::Continue(const PlanRequest& request, const std::vector<TaskGraph>& so_far,
                                                 const TaskOutputs& done, const BlobReader& read) const {
  Context context{request.scene, so_far[0].tasks[0].key, {}, TaskUs()};
  BAKEWELL_ASSIGN_OR_RETURN(context.settings, ReadSettings(request.settings));
  BAKEWELL_ASSIGN_OR_RETURN(const level_task::Survey survey, SurveyFrom(done, read));
  context.settings.photons = static_cast<int64_t>(survey.photons);
  const double texel_us = kSampleUs * SamplesOf(context.settings.quality);
  TaskGraph graph;
  const TaskKey surveyor = so_far[0].tasks[1].key;
  const TaskKey cache = AddPhotons(context, surveyor, survey, graph);
  std::vector<TaskKey> pages;
  uint32_t begin = 0;
  for (uint32_t page = 0; page < survey.tile_end_of_page.size(); ++page) {
    const uint32_t end = survey.tile_end_of_page[page];
    pages.push_back(AddPage(context, GroupTiles(survey, begin, end, texel_us, TaskUs()), page, begin, cache, graph));
    begin = end;
  }
  PlannedTask report = MakeTask(context, level_task::kReport, 0, 0, kReportUs);
  report.spec.inputs.clear();
  Need(report, "survey", surveyor, "survey");
  Need(report, "totals", cache, "totals");
  for (size_t i = 0; i < pages.size(); ++i) Need(report, absl::StrCat("tally", i), pages[i], "tally");
  graph.deliver.push_back(Add(graph, std::move(report)));
  // Clients write scene.glb with it.
  graph.artifacts.push_back({level_task::kLayoutArtifact, {context.chart, "layout"}});
  return graph;
}

}  // namespace bakewell::plan
