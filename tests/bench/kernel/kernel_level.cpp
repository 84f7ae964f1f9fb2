#include "tests/bench/kernel/kernel_level.h"

#include <filesystem>

#include "client/gltf/level.h"
#include "server/chart/choose.h"

namespace bakewell {
namespace {

class NoProgress : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

constexpr int kPhotonsPerTexel = 24, kSamples = 64, kRecordedTiles = 12;

}  // namespace

std::vector<int> KernelLevel::Tiles(int count) const {
  const int all = texels->tile_count(), step = std::max(1, all / count);
  std::vector<int> tiles;
  for (int tile = step / 2; tile < all; tile += step) tiles.push_back(tile);
  return tiles;
}

absl::StatusOr<std::unique_ptr<KernelLevel>> LoadKernelLevel(const std::string& path) {
  BakeSettings settings;
  settings.uv = UvMode::kKeep;
  auto made = std::make_unique<KernelLevel>();
  made->name = std::filesystem::path(path).stem().string();
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel loaded, LoadLevel(path));
  BAKEWELL_ASSIGN_OR_RETURN(AtlasLayout layout, ChooseCharts(loaded.scene, settings));
  NoProgress progress;
  BAKEWELL_ASSIGN_OR_RETURN(made->level, BuildLevel(std::move(loaded.scene), std::move(layout), settings, progress));
  const Level& level = *made->level;
  made->texels = level.texels->Page(0);
  settings.photons = kPhotonsPerTexel * level.texels->texel_count();
  const auto starts = [&](int walks) { return StartsOf(level, walks, settings.seed); };
  made->stage = BuildPhotonStage({*level.world, *level.lights, level.texels->texel_count(), starts}, settings.photons,
                                 settings.seed);
  made->photons.flux.resize(2 * made->stage->cells.cells().size());
  EmitPhotons(*level.world, *level.lights, made->stage->guide, made->stage->cells, made->stage->plan, 0,
              made->stage->plan.photons, progress, made->photons);
  made->cache = EstimateDensity(*level.world, made->stage->cells, made->photons, made->stage->plan, {}, progress);
  made->tree = std::make_unique<LightTree>(*level.lights);
  made->options.min_samples = made->options.max_samples = kSamples;
  made->options.mean_irradiance = MeanIrradiance(*made->texels, made->stage->cells, made->cache);
  made->bare = std::make_unique<BareScene>(*level.world);
  const RecordRays record(made->rays);
  for (const int tile : made->Tiles(kRecordedTiles)) {
    GatherCounters counters;
    GatherTile(made->scene(), level.layout, *made->texels, tile, made->options, counters);
  }
  return made;
}

}  // namespace bakewell
