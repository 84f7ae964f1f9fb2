#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

#include "client/local/level_bake.h"
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
      return {8, 32, 4, 0.12f};
    case Quality::kMedium:
      return {16, 512, 24, 0.04f};
    case Quality::kHigh:
      break;
  }
  return {32, 4096, 64, 0.015f};
}

constexpr int64_t kLeastPhotons = 32768;

// Mean luminance that the photons brought to the fronts of lightmapped surfaces, to judge errors against.
float MeanIrradiance(const TexelMap& texels, const SurfaceCells& cells, const RadianceCache& cache) {
  double sum = 0, area = 0;
  for (const Texel& texel : texels.texels) {
    const uint32_t triangle = texels.fragments[texel.fragment_begin].triangle;
    const CellIrradiance& light = cache.irradiance[2 * static_cast<size_t>(cells.CellAt(triangle, texel.position))];
    sum += static_cast<double>(Luminance(light.direct + light.indirect));
    area += 1;
  }
  return area > 0 ? static_cast<float>(sum / area) : 0;
}

void Add(const GatherCounters& from, GatherCounters& to) {
  to.gather_rays += from.gather_rays;
  to.shadow_rays += from.shadow_rays;
  to.bounce_rays += from.bounce_rays;
  to.validity_rays += from.validity_rays;
  to.bad_samples += from.bad_samples;
}

// Cells grow in number more slowly than photons, so that both the blur and the noise of the cache go to zero.
int64_t CellsFor(int64_t photons) {
  return std::max<int64_t>(1024, static_cast<int64_t>(4 * std::cbrt(static_cast<double>(photons)) *
                                                      std::cbrt(static_cast<double>(photons))));
}

struct Photons {
  SurfaceCells cells;
  RadianceCache cache;
};

absl::StatusOr<Photons> TracePhotons(const PreparedLevel& prepared, const BakeSettings& settings, int64_t count,
                                     BakedTexels& baked, PhaseClock& clock, Progress& progress) {
  const World& world = *prepared.world;
  const LightSet& lights = *prepared.lights;
  Photons result;
  clock.Begin("photons");
  const EmissionGuide guide =
      EmissionGuide::Learn(world, lights, prepared.layout, prepared.texels,
                           static_cast<int>(std::min<int64_t>(count / 16, 100000)), settings.seed);
  const PhotonPlan plan = PlanPhotons(lights, guide, count, settings.seed);
  result.cells = SurfaceCells::Build(world, CellsFor(count));
  PhotonMap map;
  map.flux.resize(2 * result.cells.cells().size());
  const int batches = settings.photon_batches;
  std::atomic<int> done{0};
  tbb::parallel_for(0, batches, [&](int batch) {
    const FlushDenormals mode;
    EmitPhotons(world, lights, guide, result.cells, plan, plan.photons * batch / batches,
                plan.photons * (batch + 1) / batches, progress, map);
    progress.Report("photons", ++done, batches);
  });
  clock.End();
  clock.Begin("density");
  result.cache = EstimateDensity(world, result.cells, map, plan, {}, progress);
  clock.End();
  baked.photons = plan.photons;
  baked.photon_rays = map.totals.rays;
  baked.density_rays = result.cache.rays;
  baked.cells = static_cast<int64_t>(result.cells.cells().size());
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  return result;
}

}  // namespace

Budget BudgetOf(const BakeSettings& settings, const TexelMap& texels) {
  const QualityNumbers numbers = NumbersOf(settings.quality);
  Budget budget;
  budget.gather.min_samples = settings.min_samples > 0 ? settings.min_samples : numbers.min_samples;
  budget.gather.max_samples = settings.max_samples > 0 ? settings.max_samples : numbers.max_samples;
  budget.gather.min_samples = std::min(budget.gather.min_samples, budget.gather.max_samples);
  budget.gather.target_error = settings.target_error > 0 ? settings.target_error : numbers.target_error;
  budget.gather.seed = settings.seed;
  const int64_t texel_count = static_cast<int64_t>(texels.texels.size());
  budget.photons =
      settings.photons > 0 ? settings.photons : std::max(kLeastPhotons, texel_count * numbers.photons_per_texel);
  return budget;
}

absl::StatusOr<BakedTexels> BakeTexels(const PreparedLevel& prepared, const BakeSettings& settings, PhaseClock& clock,
                                       Progress& progress) {
  BakedTexels baked;
  Budget budget = BudgetOf(settings, prepared.texels);
  BAKEWELL_ASSIGN_OR_RETURN(const Photons photons,
                            TracePhotons(prepared, settings, budget.photons, baked, clock, progress));
  clock.Begin("gather");
  const LightSelector selector(*prepared.lights);
  const GatherScene scene{*prepared.world, *prepared.lights, selector, photons.cells, photons.cache};
  budget.gather.mean_irradiance = MeanIrradiance(prepared.texels, photons.cells, photons.cache);
  baked.lights.resize(prepared.texels.texels.size());
  const int tiles = prepared.texels.tile_count();
  std::atomic<int> done{0};
  std::mutex mutex;
  tbb::parallel_for(0, tiles, [&](int tile) {
    if (progress.Cancelled()) return;
    const FlushDenormals mode;
    GatherCounters counters;
    const std::vector<TexelLight> lights =
        GatherTile(scene, prepared.layout, prepared.texels, tile, budget.gather, counters);
    std::copy(lights.begin(), lights.end(), baked.lights.begin() + prepared.texels.tile_begin[tile]);
    progress.Report("gather", ++done, tiles);
    const std::lock_guard<std::mutex> lock(mutex);
    Add(counters, baked.counters);
  });
  clock.End();
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  return baked;
}

}  // namespace bakewell
