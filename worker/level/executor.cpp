#include "worker/level/executor.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <tbb/parallel_for.h>

#include <map>

#include "core/artifact/page_preview.h"
#include "core/atlas/serialize.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "worker/finish/bands.h"
#include "worker/finish/filter.h"
#include "worker/level/codec.h"
#include "worker/level/page_files.h"
#include "worker/level/report.h"
#include "worker/trace/float_mode.h"

namespace bakewell {

namespace {

using level_task::KindName;

// Cancels what runs when the lease is not wanted any more.
class StopProgress final : public Progress {
 public:
  StopProgress(const std::stop_token& stop, Progress* listener)
      : listener_(listener), callback_(stop, [this] { Cancel(); }) {}
  void Report(std::string_view phase, int64_t done, int64_t total) override {
    if (listener_ != nullptr) listener_->Report(phase, done, total);
  }

 private:
  Progress* const listener_;
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

// What the tiles [begin, end) look like: an output for each page that they lie on.
MadeOutputs Previews(const TexelMap& map, int begin, std::span<const GatheredTiles> tiles) {
  std::map<int, PreviewBuilder> pages;
  for (size_t i = 0; i < tiles.size(); ++i) {
    const Texel* texel = &map.texels[map.tile_begin[static_cast<size_t>(begin) + i]];
    for (const TexelLight& light : tiles[i].lights) {
      const PageSize size = map.pages[static_cast<size_t>(texel->page)];
      PreviewBuilder& page = pages.try_emplace(texel->page, size.width, size.height).first->second;
      if (light.valid) page.Add(texel->x, texel->y, light.irradiance);
      ++texel;
    }
  }
  MadeOutputs outputs;
  for (auto& [page, builder] : pages) {
    outputs.push_back({absl::StrCat(level_task::kPreviewPrefix, page), SerializePreview(builder.Take())});
  }
  return outputs;
}

MadeOutputs CacheOutputs(const PhotonStage& stage, int64_t photon_rays, const RadianceCache& cache) {
  const level_task::PhotonCounts totals{stage.plan.photons, photon_rays, cache.rays, std::ssize(stage.cells.cells()),
                                        cache.unfaced_backs};
  return {{"cache", SerializeCache(cache)}, {"totals", level_task::Serialize(totals)}};
}

// Photons do not depend on how well texels are to be gathered, the level not on how many photons there are.
std::string PhotonSettings(const BakeSettings& settings) {
  BakeSettings relevant = settings;
  relevant.target_error = 0;
  relevant.min_samples = relevant.max_samples = 0;
  relevant.filter = true;
  return SettingsJson(relevant);
}
std::string LevelSettings(const BakeSettings& settings) {
  BakeSettings relevant = settings;
  relevant.photons = 0;
  return PhotonSettings(relevant);
}

}  // namespace

LevelExecutor::LevelExecutor(const LevelExecutorOptions& options) : options_(options) {
  if (options_.process_threads > 0) {
    limit_.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(options_.process_threads));
  }
  if (options_.threads == 1) return;
  const FlushDenormals mode;  // TBB's threads compute in the mode in which their arena began
  arena_ = std::make_unique<tbb::task_arena>(options_.threads);
  arena_->initialize();
}

void LevelExecutor::Say(std::string_view phase, int64_t done, int64_t total) const {
  if (options_.progress != nullptr) options_.progress->Report(phase, done, total);
}

void LevelExecutor::InArena(const std::function<void()>& work) { arena_ ? arena_->execute(work) : work(); }

void LevelExecutor::ForEach(int count, const std::function<void(int)>& body) {
  if (!arena_) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  arena_->execute([&] {
    tbb::parallel_for(0, count, [&](int i) {
      const FlushDenormals mode;
      body(i);
    });
  });
}

std::vector<TaskKind> LevelExecutor::Kinds() const {
  std::vector<TaskKind> kinds;
  for (const KindName& name : level_task::kAll) {
    if (name.kind != std::string_view(level_task::kChart.kind)) kinds.push_back({name.kind, name.code_version});
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

absl::StatusOr<std::shared_ptr<const Level>> LevelExecutor::LevelOf(const Work& work, Progress* listener) {
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout"}, LevelSettings(work.settings));
  return levels_.Get(key, [&]() -> Recent<Level>::Made {
    BAKEWELL_ASSIGN_OR_RETURN(const Blob scene_bytes, FindInput(work.inputs, "scene"));
    BAKEWELL_ASSIGN_OR_RETURN(const Blob layout_bytes, FindInput(work.inputs, "layout"));
    BAKEWELL_ASSIGN_OR_RETURN(Scene scene, ParseScene(std::as_bytes(std::span(*scene_bytes))));
    BAKEWELL_ASSIGN_OR_RETURN(AtlasLayout layout, ParseLayout(*layout_bytes));
    StopProgress progress(work.stop, listener);
    return BuildLevel(std::move(scene), std::move(layout), work.settings, progress);
  });
}

// made: where it is known already.
absl::StatusOr<std::shared_ptr<const PhotonStage>> LevelExecutor::PhotonStageOf(
    const Work& work, const Level& level, const std::shared_ptr<const PhotonStage>& made) {
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout"}, PhotonSettings(work.settings));
  return photon_stages_.Get(key, [&]() -> Recent<PhotonStage>::Made {
    if (made != nullptr) return made;
    if (work.settings.photons <= 0) return absl::InvalidArgumentError("the task does not say how many photons");
    const auto starts = [&](int walks) { return StartsOf(level, walks, work.settings.seed); };
    return BuildPhotonStage({*level.world, *level.lights, level.texels->texel_count(), starts}, work.settings.photons,
                            work.settings.seed);
  });
}

absl::StatusOr<MadeOutputs> LevelExecutor::Survey(const Work& work) {
  Say("texels", 0, kSurveySteps);
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work, options_.progress));
  level_task::Survey survey;
  survey.texels = static_cast<uint64_t>(level->texels->texel_count());
  StopProgress progress(work.stop, nullptr);
  PhotonChoice choice;
  InArena([&] {
    const auto starts = [&](int walks) { return StartsOf(*level, walks, work.settings.seed); };
    choice = PhotonsFor({*level->world, *level->lights, level->texels->texel_count(), starts}, work.settings, progress);
  });
  if (work.stop.stop_requested()) return absl::CancelledError("stopped");
  survey.photons = static_cast<uint64_t>(choice.photons);
  survey.has_cache = choice.flown.has_value();
  survey.opaque_alpha = level->world->opaque_alpha();
  for (const TexelPages::PageCount& page : level->texels->pages()) {
    survey.overlapping_texels += static_cast<uint64_t>(page.overlapping_texels);
    survey.texels_of_tile.insert(survey.texels_of_tile.end(), page.texels_of_tile.begin(), page.texels_of_tile.end());
    survey.tile_end_of_page.push_back(static_cast<uint32_t>(page.end_tile()));
  }
  Say("texels", kSurveySteps, kSurveySteps);
  MadeOutputs outputs{{"survey", level_task::Serialize(survey)}};
  if (choice.flown) {
    Work next = work;
    next.settings.photons = choice.photons;
    BAKEWELL_RETURN_IF_ERROR(PhotonStageOf(next, *level, choice.flown->stage).status());
    for (MadeOutput& output : CacheOutputs(*choice.flown->stage, choice.flown->rays, choice.flown->cache))
      outputs.push_back(std::move(output));
  }
  return outputs;
}

absl::StatusOr<MadeOutputs> LevelExecutor::Emit(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  Say("photons", photons_done_, std::max<int64_t>(1, work.settings.photons));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  StopProgress progress(work.stop, nullptr);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  // Batches of batches, for the threads: they add to one map.
  const int64_t photons = stage->plan.photons, parts = arena_ ? 4 * int64_t{options_.threads} : 1;
  const int64_t first = parts * work.range.begin, all = parts * std::max(1U, work.range.end);
  ForEach(static_cast<int>(parts), [&](int part) {
    const int64_t begin = photons * (first + part) / all, end = photons * (first + part + 1) / all;
    EmitPhotons(*level->world, *level->lights, stage->guide, stage->cells, stage->plan, begin, end, progress, map);
    Say("photons", photons_done_ += end - begin, photons);
  });
  if (work.stop.stop_requested()) return absl::CancelledError("stopped");  // not all photons flew
  return MadeOutputs{{"flux", SerializePhotons(map)}};
}

absl::StatusOr<MadeOutputs> LevelExecutor::Density(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  StopProgress progress(work.stop, options_.progress);
  progress.Report("density", 0, 2);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  for (const Blob& flux : InputsNamed(work.inputs, "flux")) BAKEWELL_RETURN_IF_ERROR(AddPhotons(*flux, map));
  RadianceCache cache;
  InArena([&] {
    cache = EstimateDensity(*level->world, stage->cells, map, stage->plan, DensityOf(work.settings), progress);
  });
  return CacheOutputs(*stage, map.totals.rays, cache);
}

absl::StatusOr<MadeOutputs> LevelExecutor::Gather(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  BAKEWELL_ASSIGN_OR_RETURN(const auto stage, PhotonStageOf(work, *level));
  const Digest key = KeyOfInputs(work.spec, {"scene", "layout", "cache"}, "");
  BAKEWELL_ASSIGN_OR_RETURN(const auto photons, photons_.Get(key, [&]() -> Recent<Photons>::Made {
    BAKEWELL_ASSIGN_OR_RETURN(const Blob bytes, FindInput(work.inputs, "cache"));
    auto made = std::make_shared<Photons>();
    BAKEWELL_ASSIGN_OR_RETURN(made->cache, ParseCache(*bytes));
    if (made->cache.light.size() != 2 * stage->cells.cells().size()) {
      return absl::InvalidArgumentError("the radiance cache is of other cells");
    }
    made->stage = stage;
    made->brightness.emplace(stage->cells, made->cache);
    made->mean_irradiance = MeanIrradiance(*level->texels, stage->cells, made->cache);
    made->photon_flux = MeanPhotonFlux(stage->cells, made->cache);
    return made;
  }));
  const GatherScene scene{*level->world, *level->lights, *level->tree,
                          stage->cells,  photons->cache, &*photons->brightness};
  GatherOptions options = BudgetOf(work.settings, level->texels->texel_count()).gather;
  options.mean_irradiance = photons->mean_irradiance;
  options.photon_flux = photons->photon_flux;
  const int all = level->texels->tile_count(), end = static_cast<int>(std::min<int64_t>(work.range.end, all));
  const int begin = static_cast<int>(std::min<int64_t>(work.range.begin, end));
  if (begin == end) return MadeOutputs{{"lights", SerializeTiles({})}};
  const int page = level->texels->PageOfTile(begin), first = level->texels->pages()[page].first_tile;
  if (end > level->texels->pages()[page].end_tile()) return absl::InvalidArgumentError("tiles of more than one page");
  const auto texels = level->texels->Page(page);
  std::vector<GatheredTiles> made(static_cast<size_t>(end - begin));
  ForEach(end - begin, [&](int i) {
    if (work.stop.stop_requested()) return;
    made[i].lights = GatherTile(scene, level->layout, *texels, begin - first + i, options, made[i].counters);
    Say("gather", ++tiles_done_, all);
  });
  if (work.stop.stop_requested()) return absl::CancelledError("stopped");
  MadeOutputs outputs = Previews(*texels, begin - first, made);
  outputs.push_back({"lights", SerializeTiles(made)});
  return outputs;
}

absl::StatusOr<MadeOutputs> LevelExecutor::Finish(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto level, LevelOf(work));
  const int64_t pages = std::ssize(level->texels->pages());
  Say("finish", pages_done_, pages);
  const int page = static_cast<int>(work.range.begin);
  if (work.range.begin >= pages) return absl::InvalidArgumentError("no such page");
  if (static_cast<int64_t>(work.range.end) != level->texels->pages()[page].first_tile) {
    return absl::InvalidArgumentError("the page begins with another tile");
  }
  const auto texels = level->texels->Page(page);
  std::vector<TexelLight> lights;
  lights.reserve(texels->texels.size());
  BakeTally tally;
  for (const Blob& blob : InputsNamed(work.inputs, "lights")) {
    BAKEWELL_ASSIGN_OR_RETURN(const GatherCounters counters, ParseTiles(*blob, lights));
    if (lights.size() > texels->texels.size()) return absl::InvalidArgumentError("more texels than the page has");
    tally.Count(counters);
  }
  const size_t gathered = lights.size();
  lights.resize(texels->texels.size());
  FilterCounters filtered;
  if (work.settings.filter) {
    InArena([&] {
      const std::vector<Seam> seams = SeamsOf(*level->world, *texels, page, lights, filtered);
      FilterPage(*texels, page, lights, seams, filtered);
    });
  }
  if (!work.settings.no_skip.Has(Skip::kShBands)) {
    const GatherOptions asked = BudgetOf(work.settings, level->texels->texel_count()).gather;
    SkipCount dropped;
    DropBands(*texels, page, asked.target_error, lights, dropped);
    tally.Count(Skip::kShBands, dropped);
  }
  tally.Count(std::span(lights).first(gathered), filtered);
  absl::StatusOr<MadeOutputs> files;
  InArena([&] { files = PageFiles(*texels, lights, page); });
  BAKEWELL_ASSIGN_OR_RETURN(MadeOutputs outputs, std::move(files));
  outputs.push_back({"tally", tally.Serialize()});
  Say("finish", ++pages_done_, pages);
  return outputs;
}

absl::StatusOr<MadeOutputs> LevelExecutor::Report(const Work& work) {
  BAKEWELL_ASSIGN_OR_RETURN(const Blob survey_bytes, FindInput(work.inputs, "survey"));
  BAKEWELL_ASSIGN_OR_RETURN(const level_task::Survey survey, level_task::ParseSurvey(*survey_bytes));
  BAKEWELL_ASSIGN_OR_RETURN(const Blob totals_bytes, FindInput(work.inputs, "totals"));
  BAKEWELL_ASSIGN_OR_RETURN(const level_task::PhotonCounts photons, level_task::ParsePhotonCounts(*totals_bytes));
  BakeTally tally;
  tally.Count(Skip::kUnfacedBacks, photons.unfaced_backs);
  tally.Count(Skip::kOpaqueAlpha, survey.opaque_alpha);
  for (const Blob& blob : InputsNamed(work.inputs, "tally")) {
    BAKEWELL_ASSIGN_OR_RETURN(const BakeTally page, BakeTally::Parse(*blob));
    tally.Add(page);
  }
  BAKEWELL_ASSIGN_OR_RETURN(
      const BakeReport report,
      tally.Finish(photons, static_cast<int64_t>(survey.overlapping_texels), work.settings.no_skip));
  return MadeOutputs{{level_task::kReportArtifact, ReportJson(report)}};
}

}  // namespace bakewell
