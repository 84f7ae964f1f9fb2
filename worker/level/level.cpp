#include "worker/level/level.h"

#include <algorithm>
#include <cmath>

#include "worker/trace/float_mode.h"

namespace bakewell {

namespace {

constexpr int kMostSamples = 16384;  // of a texel

struct QualityNumbers {
  int min_samples, mean_samples, photons_per_texel;
  float target_error;
};

QualityNumbers NumbersOf(Quality quality) {
  switch (quality) {
    case Quality::kPreview:
      return {4, 256, 12, 0.08f};
    case Quality::kMedium:
      return {4, 512, 48, 0.04f};
    case Quality::kHigh:
      break;
  }
  return {16, kMostSamples, 512, 0.0065f};  // sampling and photons together: 1 %
}

// Where one texel's error alone may still ask for more samples; at 8 % 256.
int WorstSamples(float target_error) {
  constexpr float kAtOne = 20.48f;
  const float samples = std::min(kAtOne / target_error, static_cast<float>(kMostSamples));
  return static_cast<int>(std::exp2(std::round(std::log2(samples))));
}

// Light below this share of the mean may have errors of its size: the less error is asked for, the dimmer what is to be
// clean. Rooms at a tenth of the mean were mottled at medium with the preview's quarter.
float FloorShare(float target_error) { return std::clamp(3 * target_error, 0.1f, 0.25f); }

// What tiles may have, over what is asked for: samples that double and neighbours in other tiles leave less than a tile
// may have.
constexpr float kTilesMay = 1.2f;

constexpr int64_t kLeastPhotons = 32768;
constexpr int64_t kMostPhotons = 4'000'000'000;  // their cells and the cache fit into 4 GB

}  // namespace

DensityOptions DensityOf(const BakeSettings& settings) {
  return {.probe_unlit = settings.no_skip.Has(Skip::kUnfacedBacks)};
}

Budget BudgetOf(const BakeSettings& settings, int64_t texels) {
  const QualityNumbers numbers = NumbersOf(settings.quality);
  Budget budget;
  budget.gather.min_samples = settings.min_samples > 0 ? settings.min_samples : numbers.min_samples;
  // An error of one's own choice may need more samples and photons than the quality's.
  const QualityNumbers limits = settings.target_error > 0 ? NumbersOf(Quality::kHigh) : numbers;
  budget.gather.max_samples = settings.max_samples > 0 ? settings.max_samples : kMostSamples;
  budget.gather.mean_samples = std::min(limits.mean_samples, budget.gather.max_samples);
  budget.gather.min_samples = std::min(budget.gather.min_samples, budget.gather.max_samples);
  budget.gather.target_error = settings.target_error > 0 ? kTilesMay * settings.target_error : numbers.target_error;
  budget.gather.worst_samples = WorstSamples(budget.gather.target_error);
  budget.gather.floor_share = FloorShare(budget.gather.target_error);
  budget.gather.seed = settings.seed;
  budget.gather.filter = settings.filter;
  budget.gather.no_skip = settings.no_skip;
  budget.least_photons = kLeastPhotons;
  budget.most_photons = std::clamp(limits.photons_per_texel * texels, kLeastPhotons, kMostPhotons);
  if (settings.photons > 0) budget.least_photons = budget.most_photons = settings.photons;
  return budget;
}

absl::StatusOr<std::shared_ptr<const Level>> BuildLevel(Scene scene, AtlasLayout layout, const BakeSettings& settings,
                                                        Progress& progress) {
  const FlushDenormals mode;
  int done = 0;
  const auto step = [&] {
    progress.Report("texels", done++, kSurveySteps);
    return progress.Cancelled() ? absl::CancelledError("stopped") : absl::OkStatus();
  };
  auto level = std::make_shared<Level>();
  level->scene = std::move(scene);
  level->layout = std::move(layout);
  BAKEWELL_RETURN_IF_ERROR(step());
  BAKEWELL_ASSIGN_OR_RETURN(level->world,
                            World::Build(level->scene, settings.backfaces, settings.albedo_limit, settings.no_skip));
  BAKEWELL_RETURN_IF_ERROR(step());
  level->lights = std::make_unique<LightSet>(*level->world, level->scene.environment);
  BAKEWELL_RETURN_IF_ERROR(step());
  level->tree = std::make_unique<LightTree>(*level->lights);
  BAKEWELL_RETURN_IF_ERROR(step());
  level->texels = std::make_unique<TexelPages>(*level->world, level->layout, settings.footprint);
  BAKEWELL_RETURN_IF_ERROR(step());
  if (level->texels->texel_count() == 0) {
    return absl::InvalidArgumentError(
        "no lightmapped surface covers a texel: every mesh has extras.lightmapped false or no area");
  }
  return level;
}

namespace {

// Adds the luminance that the photons brought to each texel to `sum`, in order.
double AddIrradiance(const TexelMap& texels, const SurfaceCells& cells, const RadianceCache& cache, double sum) {
  for (const Texel& texel : texels.texels) {
    const uint32_t triangle = texels.fragments[texel.fragment_begin].triangle;
    sum += static_cast<double>(
        Luminance(cache.light[2 * static_cast<size_t>(cells.CellAt(triangle, texel.position))].irradiance));
  }
  return sum;
}

}  // namespace

float MeanIrradiance(const TexelMap& texels, const SurfaceCells& cells, const RadianceCache& cache) {
  if (texels.texels.empty()) return 0;
  return static_cast<float>(AddIrradiance(texels, cells, cache, 0) / static_cast<double>(texels.texels.size()));
}

float MeanIrradiance(const TexelPages& texels, const SurfaceCells& cells, const RadianceCache& cache) {
  if (texels.texel_count() == 0) return 0;
  double sum = 0;
  for (int page = 0; page < static_cast<int>(texels.pages().size()); ++page) {
    sum = AddIrradiance(*texels.Page(page), cells, cache, sum);
  }
  return static_cast<float>(sum / static_cast<double>(texels.texel_count()));
}

}  // namespace bakewell
