#include "worker/gather/tile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "worker/filter/smooth_tile.h"
#include "worker/gather/budget.h"
#include "worker/gather/skip.h"
#include "worker/gather/spots.h"
#include "worker/gather/work.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"
#include "worker/texel/validity.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kCulledShare = 0.1f;      // of the target error of the tile's dimmest texel
constexpr int kDividedSamples = 32;       // at first, of a texel that lies partly inside other geometry
constexpr uint32_t kGuidedFrom = 16;      // samples; for fewer a guide costs more than it gains
constexpr int64_t kWorthLeavingOut = 64;  // texels; fewer cost less than the audit

using Work = TexelWork;

class TileGatherer {
 public:
  TileGatherer(const GatherScene& scene, const TexelMap& map, uint32_t begin, uint32_t end,
               const GatherOptions& options, GatherCounters& counters)
      : scene_(scene), map_(map), begin_(begin), end_(end), options_(options), counters_(counters) {}

  // Nothing where the audit found light that was to be left out.
  std::optional<std::vector<TexelLight>> Run(const AtlasLayout& layout) {
    Prepare(layout);
    if (!FirstRound()) return std::nullopt;
    if (options_.filter) Connect();
    for (Work& work : work_) work.direct_active = work.has_direct;
    for (Work& work : work_) work.indirect_active = work.has_indirect;
    budget_.Decide(work_);
    KeepFound();
    while (Round()) budget_.Decide(work_);
    std::vector<TexelLight> result;
    for (const Work& work : work_) result.push_back(work.Finish());
    return result;
  }

 private:
  void Prepare(const AtlasLayout& layout) {
    work_.reserve(end_ - begin_);
    for (uint32_t i = begin_; i < end_; ++i) {
      const Texel& texel = map_.texels[i];
      Work work(TexelSampler(scene_.world, layout, map_, texel));
      work.key = TexelKey(texel, options_.seed);
      work.around = LookAround(scene_.world, layout, texel, work.sampler, map_.footprint);
      work_.push_back(std::move(work));
    }
    if (lit_ ? Skips(Skip::kDarkCharts) : Skips(Skip::kNoLight)) LeaveOutDark();
    for (size_t i = 0; i < work_.size(); ++i) {
      const Texel& texel = map_.texels[begin_ + i];
      work_[i].expected = ExpectedIrradiance(scene_.cells, scene_.cache, map_, texel);
      if (work_[i].has_direct) ChooseLights(texel, work_[i].sampler.radius(), work_[i]);
    }
    if (scene_.brightness) ChooseSpots();
  }

  void ChooseSpots() {
    float expected = 0;
    bool any = false;
    for (const Work& work : work_) expected += work.expected / static_cast<float>(work_.size());
    for (const Work& work : work_) any = any || work.has_indirect;
    if (!any) return;
    spots_.emplace(scene_, *scene_.brightness, map_, std::span(map_.texels).subspan(begin_, end_ - begin_), expected,
                   TexelKey(map_.texels[begin_], options_.seed ^ 0x5907u), counters_);
    for (size_t i = 0; i < work_.size() && !spots_->empty(); ++i) {
      if (work_[i].has_indirect) work_[i].spots = spots_->ForTexel(map_.texels[begin_ + i]);
    }
  }

  void ChooseLights(const Texel& texel, float radius, Work& work) {
    if (!lights_) {
      const uint32_t tile_key = TexelKey(map_.texels[begin_], options_.seed ^ 0x711eu);
      const float dispensable =
          Skips(Skip::kCulledLights)
              ? kCulledShare * options_.target_error * DimmestIrradiance(scene_.cells, scene_.cache, map_, begin_, end_)
              : -1;
      lights_.emplace(scene_, map_, begin_, end_, tile_key, dispensable, counters_);
    }
    work.choice = lights_->ForTexel(texel, radius);
    work.has_direct = !work.choice.empty || scene_.lights.samples_distant();
  }

  bool Skips(Skip skip) const { return !options_.no_skip.Has(skip); }

  // Texels that no light reaches, but for those that are audited.
  void LeaveOutDark() {
    const PhotonDarkness darkness(scene_.cells, scene_.cache, budget_.Tolerated(0), options_.photon_flux);
    std::vector<bool> dark;
    for (const Work& work : work_) dark.push_back(!lit_ || darkness.Covers(work.sampler));
    const std::vector<bool> audited = DrawAudit(Keys(), dark);
    for (size_t i = 0; i < work_.size(); ++i) {
      work_[i].dark = dark[i];
      work_[i].audited = lit_ && audited[i];
      if (dark[i] && !work_[i].audited) work_[i].has_direct = work_[i].has_indirect = false;
    }
  }

  // What other geometry may divide is looked at closely from the start, and what it does divide has neither all of its
  // samples nor neighbours that could tell what it missed.
  uint32_t FirstSamples(const Work& work) const {
    const bool divided = work.sampler.valid_mask() != 0xffff;
    const int least = divided ? kDividedSamples : work.around.crowded ? kBlocks : options_.min_samples;
    return static_cast<uint32_t>(std::clamp(least, options_.min_samples, options_.max_samples));
  }

  std::vector<uint32_t> Keys() const {
    std::vector<uint32_t> keys;
    for (const Work& work : work_) keys.push_back(work.key);
    return keys;
  }

  // Rays over the hemisphere, which also say which texels are valid; then lights.
  // False where texels that were to be left out have light.
  bool FirstRound() {
    SkipAudit audit;
    std::vector<int64_t> rays;
    for (size_t i = 0; i < work_.size(); ++i) {
      rays.push_back(-counters_.light_rays());
      if (work_[i].has_indirect) IndirectRound(work_[i], 0, FirstSamples(work_[i]));
      Validate(map_.texels[begin_ + i], work_[i]);
      rays.back() += counters_.light_rays();
    }
    const int64_t distant = counters_.distant_found;
    for (size_t i = 0; i < work_.size(); ++i) {
      Work& work = work_[i];
      rays[i] -= counters_.light_rays();
      if (work.has_direct) DirectRound(work, 0, FirstSamples(work));
      rays[i] += counters_.light_rays();
      const float found = Luminance(work.direct.Irradiance()) + Luminance(work.indirect.Irradiance());
      if (work.audited && work.valid) audit.Found(found, options_.mean_irradiance, rays[i]);
    }
    if (Skips(Skip::kUnseenSky)) LeaveOutSky(counters_.distant_found - distant);
    audit.Count(counters_.skip);
    if (audit.passes()) CountDark(audit);
    return audit.passes();
  }

  void CountDark(const SkipAudit& audit) {
    int64_t dark = 0;
    for (const Work& work : work_) dark += work.dark && !work.audited ? 1 : 0;
    const int64_t full = lit_ ? audit.RaysOf(dark) : dark * options_.min_samples;
    counters_.skip[lit_ ? Skip::kDarkCharts : Skip::kNoLight].Add(
        {dark, std::ssize(work_), std::max<int64_t>(0, full - dark * kLeastValidityRays)});
  }

  // Suns and sky, where no gather ray of the tile escaped and no sample of the first round found them.
  void LeaveOutSky(int64_t found) {
    if (!scene_.lights.samples_distant()) return;
    const int64_t texels = std::count_if(work_.begin(), work_.end(), [](const Work& work) { return work.has_direct; });
    counters_.skip[Skip::kUnseenSky].of += texels;
    if (escaped_ > 0 || found > 0 || texels < kWorthLeavingOut) return;
    distant_ = Distant::kUnseen;
    counters_.skip[Skip::kUnseenSky].skipped += texels;
  }

  // The first round's rays guide later ones: of them a tile keeps some.
  void KeepFound() {
    // Texels that no light reaches have no say.
    float rays = 0;
    for (const Work& work : work_) rays += Luminance(work.indirect.Irradiance()) > 0 ? work.indirect.count() : 0;
    found_.Resample(static_cast<double>(rays),
                    UnitFloat(HashCombine(TexelKey(map_.texels[begin_], options_.seed), 0x9d1deu)));
    collects_ = false;
  }

  void Guide(Work& work) {
    const TexelPoint point = work.sampler.At({0.5f, 0.5f});
    work.guide = found_.GuideAt(point.surface.position, point.frame);
    work.guided = true;
  }

  // Doubles the samples of whatever is active. False when nothing was.
  bool Round() {
    bool any = false;
    for (Work& work : work_) {
      const auto indirect = static_cast<uint32_t>(work.indirect_samples);
      const auto direct = static_cast<uint32_t>(work.direct_samples);
      if (work.direct_active) DirectRound(work, direct, 2 * direct);
      if (work.indirect_active && !work.guided && indirect >= kGuidedFrom) Guide(work);
      if (work.indirect_active) IndirectRound(work, indirect, 2 * indirect);
      any = any || work.direct_active || work.indirect_active;
    }
    return any;
  }

  void DirectRound(Work& work, uint32_t done, uint32_t planned) {
    if (done > 0) work.direct.Double();
    GatherDirect(scene_, work.sampler, *lights_, work.choice, distant_, work.key, done, planned, work.direct,
                 counters_);
    if (distant_ == Distant::kUnseen) counters_.skip[Skip::kUnseenSky].saved += planned - done;
    work.direct_samples = static_cast<int>(planned);
  }

  void IndirectRound(Work& work, uint32_t done, uint32_t planned) {
    if (done > 0) work.indirect.Double();
    GatherIndirect(work, done, planned);
    work.indirect_samples = static_cast<int>(planned);
  }

  // The first round's rays say how much of the hemisphere meets back faces. A texel that turns out to lie partly or
  // wholly inside other geometry starts again from its valid parts, or not at all.
  void Validate(const Texel& texel, Work& work) {
    std::optional<BacksSeen> backs;
    if (work.indirect.count() > 0)
      backs = {work.backs / work.indirect.count(), work.nearest_back, work.indirect_samples};
    const TexelValidity validity =
        ProbeValidity(scene_.world, texel, backs, Skips(Skip::kInvalidTexels) ? PartSearch::kNear : PartSearch::kAll,
                      work.around, work.sampler);
    counters_.validity_rays += validity.rays;
    counters_.skip[Skip::kInvalidTexels].Add({validity.rays_saved > 0 ? 1 : 0, 1, validity.rays_saved});
    work.valid = validity.valid;
    work.backface_share = validity.backface_share;
    if (!work.valid) work.has_direct = work.has_indirect = false;
    if (work.valid && !validity.pushed_out && work.sampler.valid_mask() == 0xffff) return;
    work.indirect = {};
    work.group = {};
    if (!work.valid) return;
    // A texel that was pushed out lies up to its diagonal away, where other light comes.
    if (validity.pushed_out) {
      work.dark = work.audited = false;
      work.has_indirect = true;
      ChooseLights(texel, 3 * work.sampler.radius(), work);
    }
    if (work.has_indirect) IndirectRound(work, 0, FirstSamples(work));
  }

  // A ray over the hemisphere of a texel, traced.
  struct GatherRay {
    uint32_t sample, key;
    SurfacePoint from;
    Vec3f dir;
    float cosine, density;  // as Drawn
    Hit hit;
  };

  // The direction of a gather ray, and what its density is beside GatherPdf. A spot may lie behind the surface: cosine
  // <= 0, and nothing comes from there.
  struct Drawn {
    Vec3f dir;
    float cosine = 0, density = 1;
  };
  Drawn Draw(const Work& work, const TexelPoint& point, Vec2f u) const {
    const float share = work.spots.share;
    Drawn drawn;
    if (u.x < share) {
      drawn.dir = NormalizeOrZero(spots_->Draw(work.spots, {u.x / share, u.y}) - point.surface.position);
      const Vec3f local = point.frame.ToLocal(drawn.dir);
      drawn.cosine = local.z;
      if (work.guide) drawn.density = work.guide->Density(local);
    } else {
      if (share > 0) u.x = std::min((u.x - share) / (1 - share), 0x1.fffffep-1f);
      const GatherGuide::Sample guided = work.guide ? work.guide->Draw(u) : GatherGuide::Sample{u, 1};
      const Vec3f local = GatherHemisphere(guided.primary);
      drawn = {point.frame.ToWorld(local), local.z, guided.density};
    }
    if (share > 0 && drawn.cosine > 0) {
      const float aimed = spots_->Density(work.spots, point.surface.position, drawn.dir);
      drawn.density = (1 - share) * drawn.density + share * aimed / GatherPdf(drawn.cosine);
    }
    return drawn;
  }

  // Rays are traced some ahead of what is done with their hits, which are seldom in the processor's caches.
  void GatherIndirect(Work& work, uint32_t begin, uint32_t end) {
    constexpr uint32_t kAhead = 8;
    const SobolSet set(HashCombine(work.key, 0x6a7e2u));
    std::array<GatherRay, kAhead> rays;
    for (uint32_t i = begin; i < end; i += kAhead) {
      size_t traced = 0;
      for (uint32_t k = i; k < std::min(i + kAhead, end); ++k) traced += Trace(work, set, k, rays[traced]) ? 1 : 0;
      for (const GatherRay& ray : std::span(rays).first(traced)) AddFound(work, ray, end);
    }
  }

  // False where the texel's point lies inside other geometry.
  bool Trace(Work& work, const SobolSet& set, uint32_t sample, GatherRay& ray) {
    const SobolPoint u = set.At(sample);
    const TexelPoint point = work.sampler.At(u.Get2(2));
    if (!point.valid) return false;
    const uint32_t key = HashCombine(work.key, 0x80000000u | sample);
    const Drawn drawn = Draw(work, point, u.Get2(0));
    ray = {sample, key, point.surface, drawn.dir, drawn.cosine, drawn.density, {}};
    if (drawn.cosine <= 0) return true;
    ray.hit = scene_.world.Intersect(RayFrom(point.surface, drawn.dir, kInfinity, key));
    if (ray.hit) __builtin_prefetch(&CacheAt(scene_, scene_.world.PointAt(ray.hit), ray.hit.back));
    return true;
  }

  void AddFound(Work& work, const GatherRay& ray, uint32_t planned) {
    work.indirect.Count();
    if (ray.cosine <= 0) {
      work.indirect.AddIrradiance(ray.sample, planned, {});
      return;
    }
    ++counters_.gather_rays;
    if (MeetsBack(scene_.world, ray.hit)) {
      work.backs += 1 / ray.density;
      work.nearest_back = std::min(work.nearest_back, ray.hit.t);
    }
    escaped_ += ray.hit ? 0 : 1;
    const float pdf = GatherPdf(ray.cosine);
    Rgb radiance = FoundByGather(scene_, lights_ ? &*lights_ : nullptr, work.choice, ray.from, ray.dir, pdf, ray.hit);
    GatheredRadiance reflected;
    if (ray.hit) reflected = ReflectedRadiance(scene_, lights_ ? &*lights_ : nullptr, ray.hit, ray.key, counters_);
    // Multiple importance sampling went by the unguided density, here as in GatherDirect.
    radiance = (radiance + reflected.radiance) / ray.density;
    const Rgb irradiance = radiance * (ray.cosine / pdf);
    if (!IsGoodSample(radiance) || !IsGoodSample(irradiance)) {
      ++counters_.bad_samples;
      return;
    }
    const float weight = ray.cosine / (pdf * ray.density);
    for (size_t g = 0; g < kVarianceGroups; ++g) work.group[g] += reflected.group[g] * weight;
    if (collects_) {
      found_.Add(ray.hit ? scene_.world.PointAt(ray.hit).position : ray.dir, !ray.hit, Luminance(irradiance),
                 ray.density);
    }
    work.indirect.AddIrradiance(ray.sample, planned, irradiance);
    work.indirect.AddSh(ray.dir, radiance / pdf);
  }

  // Which of its neighbours each texel is connected to, for the tile's budget and for the page's filter.
  void Connect() {
    std::vector<bool> valid, crowded;
    for (const Work& work : work_) valid.push_back(work.valid);
    for (const Work& work : work_) crowded.push_back(work.around.crowded);
    SmoothTile tile(map_, begin_, end_);
    const std::vector<uint8_t> open = tile.Connect(scene_.world, valid, crowded, counters_.filter_rays);
    for (size_t i = 0; i < work_.size(); ++i) work_[i].open = open[i];
    budget_.WillBeFiltered(std::move(tile));
  }

  const GatherScene& scene_;
  const TexelMap& map_;
  const uint32_t begin_, end_;
  const GatherOptions& options_;
  GatherCounters& counters_;
  std::optional<TileLights> lights_;
  std::optional<TileSpots> spots_;
  FoundLight found_;
  bool collects_ = true;
  const bool lit_ = !scene_.tree.empty() || scene_.lights.environment().bright() || scene_.lights.samples_distant();
  int64_t escaped_ = 0;  // gather rays
  Distant distant_ = Distant::kSampled;
  TileBudget budget_{map_, begin_, options_};
  std::vector<Work> work_;
};

}  // namespace

uint32_t TexelKey(const Texel& texel, uint32_t seed) {
  const uint32_t place = HashCombine(static_cast<uint32_t>(texel.x), static_cast<uint32_t>(texel.y));
  return HashCombine(HashCombine(seed, static_cast<uint32_t>(texel.page)), place);
}

std::vector<TexelLight> GatherTile(const GatherScene& scene, const AtlasLayout& layout, const TexelMap& map, int tile,
                                   const GatherOptions& options, GatherCounters& counters) {
  const uint32_t begin = map.tile_begin[tile], end = map.tile_begin[tile + 1];
  auto lights = TileGatherer(scene, map, begin, end, options, counters).Run(layout);
  if (lights) return *std::move(lights);
  GatherOptions full = options;
  full.no_skip.Add(Skip::kDarkCharts);
  return *TileGatherer(scene, map, begin, end, full, counters).Run(layout);
}

}  // namespace bakewell
