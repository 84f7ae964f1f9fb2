#include "worker/gather/tile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "worker/filter/smooth_tile.h"
#include "worker/gather/direct.h"
#include "worker/gather/guide.h"
#include "worker/gather/noise.h"
#include "worker/gather/skip.h"
#include "worker/sample/mis.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"
#include "worker/texel/validity.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kCulledShare = 0.1f;  // of the target error of the tile's dimmest texel
constexpr uint32_t kAuditSamples = 64;
constexpr int64_t kWorthLeavingOut = 64;  // texels; fewer cost less than the audit

// Light that a gather ray finds by itself: emission and sky, weighted against the explicit samples of GatherDirect.
Rgb FoundByGather(const GatherScene& scene, const std::optional<TileLights>& lights, const TileLights::Choice& choice,
                  const SurfacePoint& from, Vec3f dir, float pdf, const Hit& hit) {
  if (!hit) {
    const EnvironmentLight& sky = scene.lights.environment();
    if (!sky.bright()) return {};
    return sky.Radiance(dir) * (sky.smooth() ? 1.0f : PowerHeuristic(pdf, sky.Pdf(dir)));
  }
  const int light = scene.lights.LightOfTriangle(hit.triangle);
  if (light < 0) return {};
  const Rgb emission = scene.world.EmissionAt(hit);
  if (MaxComponent(emission) <= 0) return {};
  const float chosen = lights ? lights->Probability(choice, from, light) : 0;
  const float light_pdf = chosen > 0 ? chosen * scene.lights.PdfLocal(light, from.position, dir, hit.t) : 0;
  return emission * PowerHeuristic(pdf, light_pdf);
}

// Everything about one texel while its tile is in flight.
struct Work {
  explicit Work(TexelSampler its_sampler) : sampler(std::move(its_sampler)) {}

  TexelSampler sampler;
  TileLights::Choice choice{};
  uint32_t key = 0;
  bool valid = true;
  bool dark = false, audited = false;  // to be left out; but computed all the same
  uint8_t open = 0;
  float direct_correction = 1, indirect_correction = 1;  // of the accumulators' variances
  float backs = 0, backface_share = 0;                   // gather rays that met a back face; their share
  bool direct_active = true, indirect_active = true;
  Accumulator direct{}, indirect{};
  std::optional<GatherGuide> guide{};          // of gather rays, after the first round
  std::array<float, kVarianceGroups> group{};  // sums of photon-borne irradiance
  int direct_samples = 0, indirect_samples = 0;

  Rgb DirectVariance() const { return direct.Variance() * direct_correction; }
  Rgb IndirectVariance() const { return indirect.Variance() * indirect_correction; }
};

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
    CorrectVariances();
    Decide();
    Guide();
    for (int done = options_.min_samples; done < options_.max_samples; done *= 2) {
      if (!Round(static_cast<uint32_t>(done), static_cast<uint32_t>(2 * done))) break;
      CorrectVariances();
      Decide();
    }
    std::vector<TexelLight> result;
    for (const Work& work : work_) result.push_back(Finish(work));
    return result;
  }

 private:
  void Prepare(const AtlasLayout& layout) {
    work_.reserve(end_ - begin_);
    for (uint32_t i = begin_; i < end_; ++i) {
      const Texel& texel = map_.texels[i];
      Work work(TexelSampler(scene_.world, layout, map_, texel));
      work.key = TexelKey(texel, options_.seed);
      work_.push_back(std::move(work));
    }
    if (lit_ ? Skips(Skip::kDarkCharts) : Skips(Skip::kNoLight)) LeaveOutDark();
    for (size_t i = 0; i < work_.size(); ++i) {
      if (work_[i].direct_active) ChooseLights(map_.texels[begin_ + i], work_[i].sampler.radius(), work_[i]);
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
    work.direct_active = !work.choice.empty || scene_.lights.samples_distant();
  }

  bool Skips(Skip skip) const { return !options_.no_skip.Has(skip); }

  // Texels that no light reaches, but for those that are audited.
  void LeaveOutDark() {
    const PhotonDarkness darkness(scene_.cells, scene_.cache, Tolerated(0), options_.photon_flux);
    std::vector<bool> dark;
    for (const Work& work : work_) dark.push_back(!lit_ || darkness.Covers(work.sampler));
    const std::vector<bool> audited = DrawAudit(Keys(), dark);
    for (size_t i = 0; i < work_.size(); ++i) {
      work_[i].dark = dark[i];
      work_[i].audited = lit_ && audited[i];
      if (dark[i] && !work_[i].audited) work_[i].direct_active = work_[i].indirect_active = false;
    }
  }

  std::vector<uint32_t> Keys() const {
    std::vector<uint32_t> keys;
    for (const Work& work : work_) keys.push_back(work.key);
    return keys;
  }

  // What errors in this irradiance are measured in: between equal absolute and equal relative errors, for what matters
  // to the root mean square and to the eye.
  float Weighing(float irradiance) const {
    const float mean = options_.mean_irradiance;
    return std::sqrt(mean * std::max(irradiance, options_.floor_share * mean));
  }
  float Tolerated(float irradiance) const { return options_.target_error * Weighing(irradiance); }

  // Rays over the hemisphere, which also say which texels are valid and whether the tile sees the sky; then lights.
  // False where texels that were to be left out have light.
  bool FirstRound() {
    const uint32_t samples = static_cast<uint32_t>(options_.min_samples);
    SkipAudit audit;
    std::vector<int64_t> rays;
    for (size_t i = 0; i < work_.size(); ++i) {
      rays.push_back(-counters_.light_rays());
      if (work_[i].indirect_active) IndirectRound(work_[i], 0, samples);
      Validate(map_.texels[begin_ + i], work_[i]);
      rays.back() += counters_.light_rays();
    }
    if (Skips(Skip::kUnseenSky)) LeaveOutSky();
    for (size_t i = 0; i < work_.size(); ++i) {
      Work& work = work_[i];
      rays[i] -= counters_.light_rays();
      if (work.direct_active) DirectRound(work, 0, samples);
      rays[i] += counters_.light_rays();
      const float found = Luminance(work.direct.Irradiance()) + Luminance(work.indirect.Irradiance());
      if (work.audited && work.valid) audit.Found(found, options_.mean_irradiance, rays[i]);
    }
    audit.Count(counters_.skip);
    if (audit.passes()) CountDark(audit);
    return audit.passes();
  }

  void CountDark(const SkipAudit& audit) {
    int64_t dark = 0;
    for (const Work& work : work_) dark += work.dark && !work.audited ? 1 : 0;
    const int64_t full = lit_ ? audit.RaysOf(dark) : dark * options_.min_samples;
    counters_.skip[lit_ ? Skip::kDarkCharts : Skip::kNoLight].Add(
        {dark, std::ssize(work_), std::max<int64_t>(0, full - dark * kValidityFirstRays)});
  }

  // Suns and sky, where no gather ray of the tile escaped and more samples of a few texels see none of them.
  void LeaveOutSky() {
    if (!scene_.lights.samples_distant()) return;
    std::vector<bool> looking;
    for (const Work& work : work_) looking.push_back(work.direct_active);
    const int64_t texels = std::count(looking.begin(), looking.end(), true);
    counters_.skip[Skip::kUnseenSky].of += texels;
    if (escaped_ > 0 || texels < kWorthLeavingOut) return;
    const std::vector<bool> audited = DrawAudit(Keys(), looking);
    SkipAudit audit;
    for (size_t i = 0; i < work_.size(); ++i) {
      if (!audited[i]) continue;
      Accumulator lost;
      GatherDirect(scene_, work_[i].sampler, *lights_, {}, Distant::kSampled, HashCombine(work_[i].key, 0x5c1u), 0,
                   kAuditSamples, lost, counters_);
      const float found = Luminance(lost.Irradiance());
      audit.Found(found, options_.mean_irradiance, 0);
    }
    audit.Count(counters_.skip);
    if (!audit.passes()) return;
    distant_ = Distant::kUnseen;
    counters_.skip[Skip::kUnseenSky].skipped += texels;
  }

  // The first round's rays guide the others.
  void Guide() {
    // Texels that no light reaches have no say.
    float rays = 0;
    for (const Work& work : work_) rays += Luminance(work.indirect.Irradiance()) > 0 ? work.indirect.count() : 0;
    found_->Resample(static_cast<double>(rays),
                     UnitFloat(HashCombine(TexelKey(map_.texels[begin_], options_.seed), 0x9d1deu)));
    for (Work& work : work_) {
      if (!work.indirect_active) continue;
      const TexelPoint point = work.sampler.At({0.5f, 0.5f});
      work.guide = found_->GuideAt(point.surface.position, point.frame);
    }
    found_.reset();
  }

  // Samples [done, planned) of every active texel. False when none was active.
  bool Round(uint32_t done, uint32_t planned) {
    bool any = false;
    for (Work& work : work_) any |= RoundOf(work, done, planned);
    return any;
  }

  bool RoundOf(Work& work, uint32_t done, uint32_t planned) {
    if (work.direct_active) DirectRound(work, done, planned);
    if (work.indirect_active) IndirectRound(work, done, planned);
    return work.direct_active || work.indirect_active;
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
    const std::optional<float> backs =
        work.indirect.count() > 0 ? std::optional(work.backs / work.indirect.count()) : std::nullopt;
    const TexelValidity validity =
        ProbeValidity(scene_.world, work.key, backs, Skips(Skip::kInvalidTexels) ? PartSearch::kNear : PartSearch::kAll,
                      work.sampler);
    counters_.validity_rays += validity.rays;
    counters_.skip[Skip::kInvalidTexels].Add({validity.rays_saved > 0 ? 1 : 0, 1, validity.rays_saved});
    work.valid = validity.valid;
    work.backface_share = validity.backface_share;
    if (!work.valid) work.direct_active = work.indirect_active = false;
    if (work.valid && !validity.pushed_out && work.sampler.valid_mask() == 0xffff) return;
    work.indirect = {};
    work.group = {};
    if (!work.valid) return;
    // A texel that was pushed out lies up to its diagonal away, where other light comes.
    if (validity.pushed_out) {
      work.dark = work.audited = false;
      work.indirect_active = true;
      ChooseLights(texel, 3 * work.sampler.radius(), work);
    }
    if (work.indirect_active) IndirectRound(work, 0, static_cast<uint32_t>(options_.min_samples));
  }

  void GatherIndirect(Work& work, uint32_t begin, uint32_t end) {
    const SobolSet set(HashCombine(work.key, 0x6a7e2u));
    for (uint32_t i = begin; i < end; ++i) {
      const SobolPoint u = set.At(i);
      const TexelPoint point = work.sampler.At(u.Get2(2));
      if (!point.valid) continue;
      work.indirect.Count();
      const GatherGuide::Sample drawn = work.guide ? work.guide->Draw(u.Get2(0)) : GatherGuide::Sample{u.Get2(0), 1};
      const Vec3f local = GatherHemisphere(drawn.primary);
      const Vec3f dir = point.frame.ToWorld(local);
      const float pdf = GatherPdf(local.z);
      const uint32_t ray_key = HashCombine(work.key, 0x80000000u | i);
      ++counters_.gather_rays;
      const Hit hit = scene_.world.Intersect(RayFrom(point.surface, dir, kInfinity, ray_key));
      work.backs += MeetsBack(scene_.world, hit) ? 1.0f : 0.0f;
      escaped_ += hit ? 0 : 1;
      Rgb radiance = FoundByGather(scene_, lights_, work.choice, point.surface, dir, pdf, hit);
      if (hit) {
        const GatheredRadiance reflected = ReflectedRadiance(scene_, hit, ray_key, counters_);
        radiance += reflected.radiance;
        for (size_t g = 0; g < kVarianceGroups; ++g)
          work.group[g] += reflected.group[g] * (local.z / (pdf * drawn.density));
      }
      if (!IsFinite(radiance)) {
        ++counters_.bad_samples;
        continue;
      }
      // Multiple importance sampling went by the unguided density, here as in GatherDirect.
      radiance = radiance / drawn.density;
      const Rgb irradiance = radiance * (local.z / pdf);
      if (found_) found_->Add(hit ? scene_.world.PointAt(hit).position : dir, !hit, Luminance(irradiance));
      work.indirect.AddIrradiance(i, end, irradiance);
      work.indirect.AddSh(dir, radiance / pdf);
    }
  }

  // Variance (luminance) averaged over the texel and those of its eight neighbours that share its chart and tile.
  template <typename Of>
  float PooledVariance(size_t i, Of of) const {
    const Texel& texel = map_.texels[begin_ + i];
    const PageSize page = map_.pages[texel.page];
    float sum = 0;
    int count = 0;
    for (int y = std::max(0, texel.y - 1); y <= std::min(page.height - 1, texel.y + 1); ++y) {
      for (int x = std::max(0, texel.x - 1); x <= std::min(page.width - 1, texel.x + 1); ++x) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x);
        const int64_t j = int64_t{map_.texel_at[texel.page][at]} - begin_;
        if (j < 0 || j >= static_cast<int64_t>(work_.size()) || !work_[j].valid) continue;
        if (map_.texels[begin_ + static_cast<size_t>(j)].chart != texel.chart) continue;
        sum += Luminance(of(work_[j]));
        ++count;
      }
    }
    return count > 0 ? sum / static_cast<float>(count) : 0;
  }

  // Which of its neighbours each texel is connected to, on the grid and for the page's filter.
  void Connect() {
    std::vector<bool> valid;
    for (const Work& work : work_) valid.push_back(work.valid);
    const std::vector<uint8_t> open =
        smooth_.emplace(map_, begin_, end_).Connect(scene_.world, valid, counters_.filter_rays);
    for (size_t i = 0; i < work_.size(); ++i) work_[i].open = open[i];
  }

  // Every texel's indirect luminance and its variance after filtering, as far as this tile can tell.
  std::vector<SmoothGrid::Smoothed> SmoothIndirect() {
    for (size_t i = 0; i < work_.size(); ++i) {
      const Work& work = work_[i];
      if (work.valid) smooth_->Put(i, Luminance(work.indirect.Irradiance()), Luminance(work.IndirectVariance()));
    }
    return smooth_->Smooth();
  }

  // How far the sets that took part in the last round are better than their blocks say.
  void CorrectVariances() {
    SetNoise direct, indirect;
    for (const Work& work : work_) {
      if (!work.valid) continue;
      if (work.direct_active) direct.Add(work.direct, Weighing(Luminance(work.direct.Irradiance())));
      if (work.indirect_active) indirect.Add(work.indirect, Weighing(Luminance(work.indirect.Irradiance())));
    }
    for (Work& work : work_) {
      if (work.direct_active) work.direct_correction = direct.Correction();
      if (work.indirect_active) work.indirect_correction = indirect.Correction();
    }
  }

  // Switches off the estimators that meet their half of the target.
  void Decide() {
    if (options_.target_error <= 0) return;
    std::vector<std::array<bool, 2>> active(work_.size());
    std::vector<SmoothGrid::Smoothed> smooth;
    if (options_.filter) smooth = SmoothIndirect();
    for (size_t i = 0; i < work_.size(); ++i) {
      const Work& work = work_[i];
      if (!work.valid) continue;
      // A stray sample must not raise its own tolerance: the smoothed light judges where there is one.
      const float indirect = options_.filter ? smooth[i].value : Luminance(work.indirect.Irradiance());
      const float irradiance = Luminance(work.direct.Irradiance()) + indirect;
      const float scale = Tolerated(irradiance);
      const float budget = 0.5f * scale * scale;
      active[i] = {work.direct_active && PooledVariance(i, [](const Work& w) { return w.DirectVariance(); }) > budget,
                   work.indirect_active && (!options_.filter || smooth[i].variance > budget) &&
                       PooledVariance(i, [](const Work& w) { return w.IndirectVariance(); }) > budget};
    }
    for (size_t i = 0; i < work_.size(); ++i) {
      work_[i].direct_active = active[i][0];
      work_[i].indirect_active = active[i][1];
    }
  }

  // Variance of the texel's irradiance that comes from the finite number of photons.
  static float PhotonVariance(const Work& work) {
    if (work.indirect.count() <= 0) return 0;
    float mean = 0, sum = 0;
    for (const float g : work.group) mean += g / kVarianceGroups;
    for (const float g : work.group) sum += (g - mean) * (g - mean);
    const float n = work.indirect.count();
    return sum / (n * n * kVarianceGroups * (kVarianceGroups - 1));
  }

  TexelLight Finish(const Work& work) const {
    TexelLight light;
    light.valid = work.valid;
    light.backface_share = work.backface_share;
    if (!work.valid) return light;
    light.irradiance = work.direct.Irradiance() + work.indirect.Irradiance();
    const RadianceSh direct = work.direct.Sh(), indirect = work.indirect.Sh();
    for (size_t i = 0; i < kShCoefficients; ++i) light.sh.lambda[i] = direct.lambda[i] + indirect.lambda[i];
    light.indirect = {work.indirect.Irradiance(), indirect, work.IndirectVariance()};
    light.variance = work.DirectVariance() + light.indirect.variance;
    // Photon noise is known in luminance; it is spread over the channels as the irradiance is.
    const float luminance = Luminance(light.irradiance);
    if (luminance > 0) {
      const Rgb share = light.irradiance / luminance;
      light.variance += share * share * PhotonVariance(work);
    }
    light.open = work.open;
    light.direct_samples = work.direct_samples;
    light.indirect_samples = work.indirect_samples;
    return light;
  }

  const GatherScene& scene_;
  const TexelMap& map_;
  const uint32_t begin_, end_;
  const GatherOptions& options_;
  GatherCounters& counters_;
  std::optional<TileLights> lights_;
  std::optional<FoundLight> found_{std::in_place};
  const bool lit_ = !scene_.tree.empty() || scene_.lights.environment().bright() || scene_.lights.samples_distant();
  int64_t escaped_ = 0;  // gather rays
  Distant distant_ = Distant::kSampled;
  std::optional<SmoothTile> smooth_;
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
