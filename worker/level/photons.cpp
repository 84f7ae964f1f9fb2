#include "worker/level/photons.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "worker/gather/outlook.h"
#include "worker/trace/float_mode.h"

namespace bakewell {
namespace {

constexpr int64_t kLeastPilot = 32768, kMostPilot = 262144;  // photons
constexpr int64_t kPilotShare = 32;                          // of the most that may be needed
constexpr int64_t kWorthAPilot = 4;                          // times as many may be needed
constexpr int kPilotPoints = 512;
constexpr double kPhotonShare = 0.35;  // of the target error
constexpr double kSetShare = 0.3;      // of the samples that independent rays would need: sets, filter and guide
constexpr double kBounceFall = 0.25;   // bounces a gather ray fall with this power of the photons
constexpr double kBounceCost = 1;      // of a bounce and its shadow rays, over a photon

class NoProgress final : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

}  // namespace

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

// Cells grow in number more slowly than photons, so that both the blur and the noise of the cache go to zero.
int64_t CellsFor(int64_t photons) {
  const double root = std::cbrt(static_cast<double>(photons));
  return std::max<int64_t>(1024, static_cast<int64_t>(4 * root * root));
}

std::shared_ptr<const PhotonStage> BuildPhotonStage(const PhotonScene& scene, int64_t photons, uint32_t seed) {
  auto stage = std::make_shared<PhotonStage>();
  stage->guide = EmissionGuide::Learn(scene.world, scene.lights,
                                      scene.starts(EmissionGuide::WalksFor(scene.lights, photons)), seed);
  stage->plan = PlanPhotons(scene.lights, stage->guide, photons, seed);
  stage->cells = SurfaceCells::Build(scene.world, CellsFor(photons), stage->guide.seen());
  return stage;
}

int64_t PhotonsFor(const PhotonScene& scene, const BakeSettings& settings, const Progress& progress) {
  const Budget budget = BudgetOf(settings, scene.texels);
  const int64_t pilot = std::clamp(budget.most_photons / kPilotShare, kLeastPilot, kMostPilot);
  if (budget.most_photons == budget.least_photons || budget.most_photons < kWorthAPilot * pilot) {
    return budget.most_photons;
  }
  const auto stage = BuildPhotonStage(scene, pilot, settings.seed);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  constexpr int kParts = 8;
  tbb::parallel_for(0, kParts, [&](int part) {
    const FlushDenormals mode;
    EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, stage->plan.photons * part / kParts,
                stage->plan.photons * (part + 1) / kParts, progress, map);
  });
  NoProgress unheard;
  const RadianceCache cache =
      EstimateDensity(scene.world, stage->cells, map, stage->plan, DensityOf(settings), unheard);
  if (progress.Cancelled()) return 0;
  const LightTree tree(scene.lights);
  const GatherOutlook outlook = LookAhead({scene.world, scene.lights, tree, stage->cells, cache},
                                          scene.starts(kPilotPoints), budget.gather.floor_share, settings.seed);
  const auto emitted = static_cast<double>(stage->plan.photons), texels = static_cast<double>(scene.texels);
  const double target = static_cast<double>(budget.gather.target_error), share = kPhotonShare * target;
  const double for_noise = outlook.photon_variance / (share * share) * emitted;
  const double samples =
      std::clamp(kSetShare * outlook.ray_variance / (target * target), static_cast<double>(budget.gather.min_samples),
                 static_cast<double>(budget.gather.max_samples));
  // Where photons p^b cost as much as a bounce saves: the derivative of photons + bounces by p is zero.
  const double bounces = texels * samples * outlook.bounces;
  const double for_cost =
      std::pow(kBounceCost * kBounceFall * bounces * std::pow(emitted, kBounceFall), 1 / (1 + kBounceFall));
  const double needed = std::min(std::max(for_noise, for_cost), static_cast<double>(budget.most_photons));
  return std::clamp(static_cast<int64_t>(needed), budget.least_photons, budget.most_photons);
}

}  // namespace bakewell
