#include "worker/level/level.h"

#include <algorithm>
#include <cmath>

#include "worker/trace/float_mode.h"

namespace bakewell {

namespace {

struct QualityNumbers {
  int min_samples, max_samples, photons_per_texel;
  float target_error;
};

QualityNumbers NumbersOf(Quality quality) {
  switch (quality) {
    case Quality::kPreview:
      return {8, 256, 6, 0.08f};
    case Quality::kMedium:
      return {8, 512, 24, 0.04f};
    case Quality::kHigh:
      break;
  }
  return {16, 16384, 512, 0.0065f};  // sampling and photons together: 1 %
}

constexpr int64_t kLeastPhotons = 32768;
constexpr int64_t kMostPhotons = 4'000'000'000;  // their cells and the cache fit into 4 GB

}  // namespace

// Cells grow in number more slowly than photons, so that both the blur and the noise of the cache go to zero.
int64_t CellsFor(int64_t photons) {
  const double root = std::cbrt(static_cast<double>(photons));
  return std::max<int64_t>(1024, static_cast<int64_t>(4 * root * root));
}

bool Filters(const BakeSettings& settings) { return settings.filter && settings.quality != Quality::kHigh; }

DensityOptions DensityOf(const BakeSettings& settings) {
  return {.probe_unlit = settings.no_skip.Has(Skip::kUnfacedBacks)};
}

Budget BudgetOf(const BakeSettings& settings, int64_t texels) {
  const QualityNumbers numbers = NumbersOf(settings.quality);
  Budget budget;
  budget.gather.min_samples = settings.min_samples > 0 ? settings.min_samples : numbers.min_samples;
  budget.gather.max_samples = settings.max_samples > 0 ? settings.max_samples : numbers.max_samples;
  budget.gather.min_samples = std::min(budget.gather.min_samples, budget.gather.max_samples);
  budget.gather.target_error = settings.target_error > 0 ? settings.target_error : numbers.target_error;
  budget.gather.seed = settings.seed;
  budget.gather.filter = Filters(settings);
  budget.gather.no_skip = settings.no_skip;
  budget.photons = settings.photons > 0 ? settings.photons
                                        : std::clamp(texels * numbers.photons_per_texel, kLeastPhotons, kMostPhotons);
  return budget;
}

absl::StatusOr<std::shared_ptr<const Level>> BuildLevel(Scene scene, AtlasLayout layout, const BakeSettings& settings) {
  const FlushDenormals mode;
  auto level = std::make_shared<Level>();
  level->scene = std::move(scene);
  level->layout = std::move(layout);
  BAKEWELL_ASSIGN_OR_RETURN(level->world,
                            World::Build(level->scene, settings.backfaces, settings.albedo_limit, settings.no_skip));
  level->lights = std::make_unique<LightSet>(*level->world, level->scene.environment);
  level->tree = std::make_unique<LightTree>(*level->lights);
  level->texels = std::make_unique<TexelPages>(*level->world, level->layout, settings.footprint);
  if (level->texels->texel_count() == 0) {
    return absl::InvalidArgumentError(
        "no lightmapped surface covers a texel: every mesh has extras.lightmapped false or no area");
  }
  level->photons = BudgetOf(settings, level->texels->texel_count()).photons;
  return level;
}

namespace {

// Where the guide's walks start, page by page.
std::vector<TexelPoint> StartsOf(const Level& level, int walks, uint32_t seed) {
  const TexelPages& texels = *level.texels;
  std::vector<TexelPoint> points(static_cast<size_t>(walks));
  for (int page = 0; page < static_cast<int>(texels.pages().size()); ++page) {
    const TexelPages::PageCount& count = texels.pages()[static_cast<size_t>(page)];
    const auto map = texels.Page(page);
    for (int walk = 0; walk < walks; ++walk) {
      const auto start = EmissionGuide::StartOf(walk, static_cast<size_t>(texels.texel_count()), seed);
      const int64_t texel = static_cast<int64_t>(start.texel) - count.first_texel;
      if (texel < 0 || texel >= count.texels) continue;
      const TexelSampler sampler(*level.world, level.layout, *map, map->texels[static_cast<size_t>(texel)]);
      points[static_cast<size_t>(walk)] = sampler.At(start.u);
    }
  }
  return points;
}

// Adds the luminance that the photons brought to each texel to `sum`, in order.
double AddIrradiance(const TexelMap& texels, const SurfaceCells& cells, const RadianceCache& cache, double sum) {
  for (const Texel& texel : texels.texels) {
    const uint32_t triangle = texels.fragments[texel.fragment_begin].triangle;
    const CellIrradiance& light = cache.irradiance[2 * static_cast<size_t>(cells.CellAt(triangle, texel.position))];
    sum += static_cast<double>(Luminance(light.direct + light.indirect));
  }
  return sum;
}

}  // namespace

std::shared_ptr<const PhotonStage> BuildPhotonStage(const Level& level, const BakeSettings& settings) {
  const int64_t count = level.photons;
  const int walks = EmissionGuide::WalksFor(*level.lights, count);
  auto stage = std::make_shared<PhotonStage>();
  stage->guide =
      EmissionGuide::Learn(*level.world, *level.lights, StartsOf(level, walks, settings.seed), settings.seed);
  stage->plan = PlanPhotons(*level.lights, stage->guide, count, settings.seed);
  stage->cells = SurfaceCells::Build(*level.world, CellsFor(count), stage->guide.seen());
  return stage;
}

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
