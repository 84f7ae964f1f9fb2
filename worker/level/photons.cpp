#include "worker/level/photons.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "worker/gather/outlook.h"
#include "worker/trace/float_mode.h"

namespace bakewell {
namespace {

constexpr int64_t kPilot = 32768, kNextPilot = 8, kMostPilot = 262144;  // photons
constexpr int64_t kWorthAPilot = 2;                                     // times its photons may be needed
constexpr int64_t kTrusted = 16;  // times its photons a pilot may ask for; else a larger one is asked
constexpr double kFarBeyond = 2;  // times the most photons there are: no larger pilot would ask for fewer
constexpr size_t kPilotPoints = 512;
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

namespace {

std::shared_ptr<const PhotonStage> StageFrom(const PhotonScene& scene, std::span<const TexelPoint> starts,
                                             int64_t photons, uint32_t seed) {
  auto stage = std::make_shared<PhotonStage>();
  stage->guide = EmissionGuide::Learn(scene.world, scene.lights, starts, seed);
  stage->plan = PlanPhotons(scene.lights, stage->guide, photons, seed);
  stage->cells = SurfaceCells::Build(scene.world, CellsFor(photons), stage->guide.seen());
  return stage;
}

}  // namespace

std::shared_ptr<const PhotonStage> BuildPhotonStage(const PhotonScene& scene, int64_t photons, uint32_t seed) {
  return StageFrom(scene, scene.starts(EmissionGuide::WalksFor(scene.lights, photons)), photons, seed);
}

namespace {

// What a gather would find over its photons.
struct Pilot {
  FlownPhotons flown;
  GatherOutlook outlook;
};

Pilot FlyPilot(const PhotonScene& scene, const BakeSettings& settings, float floor_share, int64_t photons,
               const Progress& progress) {
  // The pages of a large level are cut once for both.
  const std::vector<TexelPoint> points = scene.starts(EmissionGuide::WalksFor(scene.lights, photons));
  const auto stage = StageFrom(scene, points, photons, settings.seed);
  PhotonMap map;
  map.flux.resize(2 * stage->cells.cells().size());
  constexpr int kParts = 8;
  tbb::parallel_for(0, kParts, [&](int part) {
    const FlushDenormals mode;
    EmitPhotons(scene.world, scene.lights, stage->guide, stage->cells, stage->plan, stage->plan.photons * part / kParts,
                stage->plan.photons * (part + 1) / kParts, progress, map);
  });
  NoProgress unheard;
  Pilot pilot;
  pilot.flown = {stage, EstimateDensity(scene.world, stage->cells, map, stage->plan, DensityOf(settings), unheard),
                 map.totals.rays};
  const LightTree tree(scene.lights);
  pilot.outlook = LookAhead({scene.world, scene.lights, tree, stage->cells, pilot.flown.cache},
                            std::span(points).first(std::min(points.size(), kPilotPoints)), floor_share, settings.seed);
  return pilot;
}

// Enough for their noise, and for gather rays that need not bounce on where cells are large.
double Needed(const Pilot& pilot, const GatherOptions& gather, int64_t texels) {
  const auto target = static_cast<double>(gather.target_error);
  const double share = kPhotonShare * target;
  const auto photons = static_cast<double>(pilot.flown.stage->plan.photons);
  const double for_noise = pilot.outlook.photon_variance / (share * share) * photons;
  const double samples = std::clamp(kSetShare * pilot.outlook.ray_variance / (target * target),
                                    static_cast<double>(gather.min_samples), static_cast<double>(gather.mean_samples));
  // Where photons p^b cost as much as a bounce saves: the derivative of photons + bounces by p is zero.
  const double bounces = static_cast<double>(texels) * samples * pilot.outlook.bounces;
  const double for_cost =
      std::pow(kBounceCost * kBounceFall * bounces * std::pow(photons, kBounceFall), 1 / (1 + kBounceFall));
  return std::max(for_noise, for_cost);
}

}  // namespace

PhotonChoice PhotonsFor(const PhotonScene& scene, const BakeSettings& settings, const Progress& progress) {
  const Budget budget = BudgetOf(settings, scene.texels);
  const auto most = static_cast<double>(budget.most_photons);
  PhotonChoice choice{budget.most_photons, {}};
  if (budget.most_photons == budget.least_photons) return choice;
  for (int64_t pilot = kPilot; pilot <= kMostPilot && kWorthAPilot * pilot <= budget.most_photons;
       pilot *= kNextPilot) {
    Pilot flight = FlyPilot(scene, settings, budget.gather.floor_share, pilot, progress);
    if (progress.Cancelled()) return {};
    const double needed = Needed(flight, budget.gather, scene.texels);
    // What is no number (light beyond what floats hold) is no reason for few.
    choice.photons = needed < most ? std::max(static_cast<int64_t>(needed), budget.least_photons) : budget.most_photons;
    if (choice.photons == pilot) choice.flown = std::move(flight.flown);
    if (choice.flown || needed <= static_cast<double>(kTrusted * pilot) || needed > kFarBeyond * most) break;
  }
  return choice;
}

}  // namespace bakewell
