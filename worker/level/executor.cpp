#include "worker/level/executor.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include "core/artifact/json_line.h"
#include "core/atlas/serialize.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "worker/finish/filter.h"
#include "worker/level/codec.h"
#include "worker/level/page_files.h"
#include "worker/trace/float_mode.h"

namespace bakewell {

namespace {

using level_task::KindName;

constexpr double kMostBadSamples = 1e-6;  // share of NaN or infinite samples above which a bake fails

// Cancels what runs when the lease is not wanted any more.
class StopProgress final : public Progress {
 public:
  explicit StopProgress(const std::stop_token& stop) : callback_(stop, [this] { Cancel(); }) {}
  void Report(std::string_view, int64_t, int64_t) override {}

 private:
  std::stop_callback<std::function<void()>> callback_;
};

absl::StatusOr<BakeSettings> SettingsOf(const std::string& json) {
  return SettingsFromJson(json, [](const std::string&) -> absl::StatusOr<Environment> {
    return absl::InvalidArgumentError("a task's settings name no picture: its scene has the environment");
  });
}

// Every input whose name begins so, in order.
std::vector<Blob> InputsNamed(const TaskInputs& inputs, absl::string_view prefix) {
  std::vector<Blob> blobs;
  for (const auto& [name, blob] : inputs) {
    if (absl::StartsWith(name, prefix)) blobs.push_back(blob);
  }
  return blobs;
}

Digest KeyOfInputs(const TaskSpec& spec, std::initializer_list<absl::string_view> names, const std::string& more) {
  FieldWriter writer;
  for (const TaskInput& input : spec.inputs) {
    const bool counts = std::find(names.begin(), names.end(), absl::string_view(input.name)) != names.end();
    if (counts) writer.PutDigest(std::get<Digest>(input.source));
  }
  writer.PutString(more);
  return Sha256Of(writer.bytes());
}

// Level and photons do not depend on how well texels are to be gathered.
std::string LevelSettings(const BakeSettings& settings) {
  BakeSettings relevant = settings;
  relevant.target_error = 0;
  relevant.min_samples = relevant.max_samples = 0;
  relevant.filter = true;
  return SettingsJson(relevant);
}

}  // namespace

std::vector<TaskKind> LevelExecutor::Kinds() const {
  std::vector<TaskKind> kinds;
  for (const KindName& name : {level_task::kSurvey, level_task::kEmit, level_task::kDensity, level_task::kGather,
                               level_task::kFinish, level_task::kReport}) {
    kinds.push_back({name.kind, name.code_version});
  }
  return kinds;
}

absl::StatusOr<MadeOutputs> LevelExecutor::Run(const TaskSpec& spec, const TaskInputs& inputs, std::stop_token stop) {
  const FlushDenormals mode;
  Work work{spec, inputs, stop, {}, {}};
  BAKEWELL_ASSIGN_OR_RETURN(work.range, level_task::ParseSettings(spec.settings));
  BAKEWELL_ASSIGN_OR_RETURN(work.settings, SettingsOf(work.range.settings_json));
  if (spec.kind == level_task::kSurvey.kind) return Survey(work);
  if (spec.kind == level_task::kEmit.kind) return Emit(work);
  if (spec.kind == level_task::kDensity.kind) return Density(work);
  if (spec.kind == level_task::kGather.kind) return Gather(work);
  if (spec.kind == level_task::kFinish.kind) return Finish(work);
  if (spec.kind == level_task::kReport.kind) return Report(work);
  return absl::UnimplementedError(absl::StrCat("this worker does not know ", spec.kind));
}

absl::StatusOr<std::shared_ptr<const Level>> LevelExecutor::LevelOf(const Work& work) {
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout"}, LevelSettings(work.settings));
  return levels_.Get(key, [&]() -> Recent<Level>::Made {
    BAKEWELL_ASSIGN_OR_RETURN(const Blob scene_bytes, FindInput(work.inputs, "scene"));
    BAKEWELL_ASSIGN_OR_RETURN(const Blob layout_bytes, FindInput(work.inputs, "layout"));
    BAKEWELL_ASSIGN_OR_RETURN(Scene scene, ParseScene(std::as_bytes(std::span(*scene_bytes))));
    BAKEWELL_ASSIGN_OR_RETURN(AtlasLayout layout, ParseLayout(*layout_bytes));
    return BuildLevel(std::move(scene), std::move(layout), work.settings);
  });
}

absl::StatusOr<std::shared_ptr<const PhotonStage>> LevelExecutor::PhotonStageOf(const Work& work, const Level& level) {
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout"}, LevelSettings(work.settings));
  return photon_stages_.Get(key, [&]() -> Recent<PhotonStage>::Made { return BuildPhotonStage(level, work.settings); });
}

absl::StatusOr<MadeOutputs> LevelExecutor::Survey(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  const TexelMap& map = level->texels;
  level_task::Survey survey;
  survey.texels = map.texels.size();
  survey.photons = static_cast<uint64_t>(level->photons);
  survey.tile_end_of_page.assign(map.pages.size(), 0);
  for (int tile = 0; tile < map.tile_count(); ++tile) {
    const uint32_t begin = map.tile_begin[tile], end = map.tile_begin[tile + 1];
    survey.texels_of_tile.push_back(end - begin);
    if (end > begin) survey.tile_end_of_page[map.texels[begin].page] = static_cast<uint32_t>(tile + 1);
  }
  // A page without texels ends where the one before it ends.
  for (size_t page = 1; page < survey.tile_end_of_page.size(); ++page) {
    survey.tile_end_of_page[page] = std::max(survey.tile_end_of_page[page], survey.tile_end_of_page[page - 1]);
  }
  return MadeOutputs{{"survey", level_task::Serialize(survey)}};
}

absl::StatusOr<MadeOutputs> LevelExecutor::Emit(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  StopProgress progress(work.stop);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  const int64_t photons = stage->plan.photons, batch = work.range.begin, batches = std::max(1U, work.range.end);
  EmitPhotons(*level->world, *level->lights, stage->guide, stage->cells, stage->plan, photons * batch / batches,
              photons * (batch + 1) / batches, progress, map);
  return MadeOutputs{{"flux", SerializePhotons(map)}};
}

absl::StatusOr<MadeOutputs> LevelExecutor::Density(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  StopProgress progress(work.stop);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  for (const Blob& flux : InputsNamed(work.inputs, "flux")) BAKEWELL_RETURN_IF_ERROR(AddPhotons(*flux, map));
  const RadianceCache cache = EstimateDensity(*level->world, stage->cells, map, stage->plan, {}, progress);
  return MadeOutputs{{"cache", SerializeCache(cache)}};
}

absl::StatusOr<MadeOutputs> LevelExecutor::Gather(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout", "cache"}, "");
  BAKEWELL_ASSIGN_OR_RETURN(const auto photons, photons_.Get(key, [&]() -> Recent<Photons>::Made {
    BAKEWELL_ASSIGN_OR_RETURN(const Blob bytes, FindInput(work.inputs, "cache"));
    auto made = std::make_shared<Photons>();
    BAKEWELL_ASSIGN_OR_RETURN(made->cache, ParseCache(*bytes));
    if (made->cache.irradiance.size() != 2 * stage->cells.cells().size()) {
      return absl::InvalidArgumentError("the radiance cache is of other cells");
    }
    made->mean_irradiance = MeanIrradiance(level->texels, stage->cells, made->cache);
    return made;
  }));
  const LightTree tree(*level->lights);
  const GatherScene scene{*level->world, *level->lights, tree, stage->cells, photons->cache};
  GatherOptions options = BudgetOf(work.settings, level->texels).gather;
  options.mean_irradiance = photons->mean_irradiance;
  GatheredTiles tiles;
  const uint32_t end = std::min(work.range.end, static_cast<uint32_t>(level->texels.tile_count()));
  for (uint32_t tile = work.range.begin; tile < end; ++tile) {
    if (work.stop.stop_requested()) return absl::CancelledError("stopped");
    const auto lights =
        GatherTile(scene, level->layout, level->texels, static_cast<int>(tile), options, tiles.counters);
    tiles.lights.insert(tiles.lights.end(), lights.begin(), lights.end());
  }
  return MadeOutputs{{"lights", SerializeTiles(tiles)}};
}

absl::StatusOr<MadeOutputs> LevelExecutor::Finish(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  // The tasks' tiles are consecutive; range.end says with which tile they begin.
  std::vector<TexelLight> lights(level->texels.texels.size());
  if (work.range.end > static_cast<uint32_t>(level->texels.tile_count())) {
    return absl::InvalidArgumentError("a page begins behind the last tile");
  }
  size_t next = level->texels.tile_begin[work.range.end];
  for (const Blob& blob : InputsNamed(work.inputs, "lights")) {
    BAKEWELL_ASSIGN_OR_RETURN(const GatheredTiles tiles, ParseTiles(*blob));
    if (tiles.lights.size() > lights.size() - next) return absl::InvalidArgumentError("more texels than the level has");
    std::copy(tiles.lights.begin(), tiles.lights.end(), lights.begin() + static_cast<ptrdiff_t>(next));
    next += tiles.lights.size();
  }
  const int page = static_cast<int>(work.range.begin);
  FilterCounters filtered;
  if (page >= static_cast<int>(level->texels.pages.size())) return absl::InvalidArgumentError("no such page");
  if (Filters(work.settings)) FilterPage(level->texels, page, lights, filtered);
  return PageFiles(level->texels, lights, page);
}

absl::StatusOr<MadeOutputs> LevelExecutor::Report(const Work& work) {
  GatherCounters sum;
  int64_t texels = 0, invalid = 0;
  for (const Blob& blob : InputsNamed(work.inputs, "lights")) {
    BAKEWELL_ASSIGN_OR_RETURN(const GatheredTiles tiles, ParseTiles(*blob));
    sum.gather_rays += tiles.counters.gather_rays;
    sum.shadow_rays += tiles.counters.shadow_rays;
    sum.bounce_rays += tiles.counters.bounce_rays;
    sum.validity_rays += tiles.counters.validity_rays;
    sum.filter_rays += tiles.counters.filter_rays;
    sum.bad_samples += tiles.counters.bad_samples;
    texels += std::ssize(tiles.lights);
    for (const TexelLight& light : tiles.lights) invalid += light.valid ? 0 : 1;
  }
  if (static_cast<double>(sum.bad_samples) > kMostBadSamples * static_cast<double>(sum.gather_rays + sum.shadow_rays)) {
    return absl::InvalidArgumentError(absl::StrCat(sum.bad_samples,
                                                   " samples were NaN or infinite; lights or emission "
                                                   "of this scene are beyond what float can hold"));
  }
  const std::string json = JsonLine()
                               .Add("texels/covered", texels)
                               .Add("texels/invalid", invalid)
                               .Add("gather/rays", sum.gather_rays)
                               .Add("gather/shadow_rays", sum.shadow_rays)
                               .Add("gather/bounce_rays", sum.bounce_rays)
                               .Add("gather/bad_samples", sum.bad_samples)
                               .Add("filter/rays", sum.filter_rays)
                               .Add("texels/validity_rays", sum.validity_rays)
                               .Text();
  return MadeOutputs{{"statistics.json", json + "\n"}};
}

}  // namespace bakewell
