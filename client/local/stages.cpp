#include "client/local/bake_texels.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

#include "worker/gather/brightness.h"
#include "worker/trace/float_mode.h"

namespace bakewell {
namespace {

struct Photons {
  SurfaceCells cells;
  RadianceCache cache;
};

absl::StatusOr<Photons> TracePhotons(const PreparedLevel& prepared, const BakeSettings& settings, BakedTexels& baked,
                                     PhaseClock& clock, Progress& progress) {
  const World& world = *prepared.world;
  const LightSet& lights = *prepared.lights;
  Photons result;
  clock.Begin("photons");
  const auto starts = [&](int walks) {
    return EmissionGuide::StartsIn(world, prepared.layout, prepared.texels, walks, settings.seed);
  };
  const PhotonScene scene{world, lights, std::ssize(prepared.texels.texels), starts};
  const auto stage = BuildPhotonStage(scene, PhotonsFor(scene, settings, progress).photons, settings.seed);
  const PhotonPlan& plan = stage->plan;
  result.cells = stage->cells;
  PhotonMap map;
  map.flux.resize(2 * result.cells.cells().size());
  const int batches = settings.photon_batches;
  std::atomic<int> done{0};
  tbb::parallel_for(0, batches, [&](int batch) {
    const FlushDenormals mode;
    EmitPhotons(world, lights, stage->guide, result.cells, plan, plan.photons * batch / batches,
                plan.photons * (batch + 1) / batches, progress, map);
    progress.Report("photons", ++done, batches);
  });
  clock.End();
  clock.Begin("density");
  result.cache = EstimateDensity(world, result.cells, map, plan, DensityOf(settings), progress);
  clock.End();
  baked.photons = plan.photons;
  baked.photon_rays = map.totals.rays;
  baked.density_rays = result.cache.rays;
  baked.counters.skip[Skip::kUnfacedBacks] = result.cache.unfaced_backs;
  baked.counters.skip[Skip::kOpaqueAlpha] = world.opaque_alpha();
  baked.cells = static_cast<int64_t>(result.cells.cells().size());
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  return result;
}

}  // namespace

absl::StatusOr<BakedTexels> BakeTexels(const PreparedLevel& prepared, const BakeSettings& settings, PhaseClock& clock,
                                       Progress& progress) {
  BakedTexels baked;
  Budget budget = BudgetOf(settings, std::ssize(prepared.texels.texels));
  BAKEWELL_ASSIGN_OR_RETURN(const Photons photons, TracePhotons(prepared, settings, baked, clock, progress));
  clock.Begin("gather");
  const LightTree tree(*prepared.lights);
  const BrightnessPyramid brightness(photons.cells, photons.cache);
  const GatherScene scene{*prepared.world, *prepared.lights, tree, photons.cells, photons.cache, &brightness};
  budget.gather.mean_irradiance = MeanIrradiance(prepared.texels, photons.cells, photons.cache);
  budget.gather.photon_flux = MeanPhotonFlux(photons.cells, photons.cache);
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
    baked.counters.Add(counters);
  });
  clock.End();
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  if (settings.filter) {
    clock.Begin("filter");
    const int pages = static_cast<int>(prepared.texels.pages.size());
    for (int page = 0; page < pages; ++page) {
      const std::vector<Seam> seams = SeamsOf(*prepared.world, prepared.texels, page, baked.lights, baked.filter);
      FilterPage(prepared.texels, page, baked.lights, seams, baked.filter);
      progress.Report("filter", page + 1, pages);
    }
    clock.End();
  }
  return baked;
}

}  // namespace bakewell
