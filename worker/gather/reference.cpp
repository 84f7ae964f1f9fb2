#include "worker/gather/reference.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <limits>

#include "worker/gather/tile.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"
#include "worker/texel/sampler.h"
#include "worker/texel/validity.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kReplicas = 16;  // independently scrambled point sets, whose spread is the standard error
constexpr int kSobolBounces = 4;

// Random numbers of one path: Sobol sets for the first bounces, hashes after.
class PathNumbers {
 public:
  PathNumbers(uint32_t key, uint32_t index) : key_(key), index_(index) {
    for (int b = 0; b < kSobolBounces; ++b) sets_.emplace_back(HashCombine(key, static_cast<uint32_t>(b)));
  }
  void Restart(uint32_t index) { index_ = index; }
  float Get(int bounce, int dimension) const {
    if (bounce < kSobolBounces) return sets_[bounce].At(index_).Get(dimension);
    const uint32_t what = static_cast<uint32_t>(16 * bounce + dimension);
    return UnitFloat(HashCombine(HashCombine(key_, index_), what));
  }
  Vec2f Get2(int bounce, int dimension) const { return {Get(bounce, dimension), Get(bounce, dimension + 1)}; }
  uint32_t RayKey(int bounce) const {
    return HashCombine(HashCombine(key_, 0xa1fau + static_cast<uint32_t>(bounce)), index_);
  }

 private:
  uint32_t key_, index_;
  std::vector<SobolSet> sets_;
};

class PathTracer {
 public:
  PathTracer(const World& world, const LightSet& lights) : world_(world), lights_(lights), tree_(lights) {}

  // Irradiance estimate of one path that starts at `point`; dimensions 0..1 of bounce 0 belong to the caller.
  // Directional lights shine on `under_sun` (TexelSampler::AtMirrored) at the first surface.
  Rgb Trace(SurfacePoint point, const SurfacePoint& under_sun, Frame frame, const PathNumbers& numbers) {
    Rgb irradiance, throughput{1, 1, 1};
    for (int bounce = 0;; ++bounce) {
      irradiance += throughput * Direct(point, bounce == 0 ? under_sun : point, numbers, bounce);
      const Vec3f dir = frame.ToWorld(CosineHemisphere(numbers.Get2(bounce, 2)));
      ++rays_;
      const Hit hit = world_.Intersect(RayFrom(point, dir, kInfinity, numbers.RayKey(bounce)));
      irradiance += throughput * Found(point, dir, hit) * kPiF;
      if (!hit) return irradiance;
      throughput = throughput * world_.AlbedoAt(hit);
      const float survive =
          bounce < 3 ? std::min(1.0f, 2 * MaxComponent(throughput)) : std::min(0.98f, MaxComponent(throughput));
      if (survive <= 0 || numbers.Get(bounce, 7) >= survive) return irradiance;
      throughput = throughput / survive;
      point = world_.PointAt(hit);
      frame = FrameFromHint(point.normal, world_.triangles()[hit.triangle].e1);
    }
  }
  int64_t rays() const { return rays_; }

 private:
  Rgb Direct(const SurfacePoint& point, const SurfacePoint& under_sun, const PathNumbers& numbers, int bounce) {
    Rgb irradiance;
    if (!tree_.empty()) {
      const auto pick = tree_.Draw(LightTree::kRoot, {point.position, point.normal}, numbers.Get(bounce, 4));
      if (pick.light >= 0) {
        irradiance += Arriving(point, lights_.SampleLocal(pick.light, point.position, numbers.Get2(bounce, 5)),
                               pick.probability, numbers.RayKey(bounce));
      }
    }
    for (size_t i = 0; i < lights_.directionals().size(); ++i) {
      const uint32_t key = HashCombine(numbers.RayKey(bounce), static_cast<uint32_t>(i));
      irradiance += Arriving(
          under_sun, lights_.SampleDirectional(static_cast<int>(i), {UnitFloat(Hash(key)), UnitFloat(Hash(key + 1))}),
          1, key);
    }
    if (lights_.environment().bright() && !lights_.environment().smooth()) {
      const uint32_t key = HashCombine(numbers.RayKey(bounce), 0x5e4u);
      irradiance +=
          Arriving(point, lights_.SampleEnvironment({UnitFloat(Hash(key)), UnitFloat(Hash(key + 1))}), 1, key);
    }
    return irradiance;
  }

  Rgb Arriving(const SurfacePoint& point, const LightSample& sample, float probability, uint32_t key) {
    const float cosine = Dot(sample.dir, point.normal);
    if (cosine <= 0 || MaxComponent(sample.perpendicular) <= 0 || probability <= 0) return {};
    ++rays_;
    if (world_.Occluded(ShadowRay(point, sample, key))) return {};
    const float pdf = sample.pdf * probability, other = cosine * kInvPiF;
    return sample.perpendicular * (cosine / probability * (sample.pdf > 0 ? pdf / (pdf + other) : 1.0f));
  }

  // Emission and sky met by a cosine-drawn direction.
  Rgb Found(const SurfacePoint& point, Vec3f dir, const Hit& hit) const {
    const float pdf = std::max(1e-12f, Dot(dir, point.normal)) * kInvPiF;
    if (!hit) {
      const EnvironmentLight& sky = lights_.environment();
      if (!sky.bright()) return {};
      return sky.Radiance(dir) * (sky.smooth() ? 1.0f : pdf / (pdf + sky.Pdf(dir)));
    }
    const int light = lights_.LightOfTriangle(hit.triangle);
    if (light < 0) return {};
    const Rgb emission = world_.EmissionAt(hit);
    if (MaxComponent(emission) <= 0) return {};
    const float other = tree_.Probability(LightTree::kRoot, light, {point.position, point.normal}) *
                        lights_.PdfLocal(light, point.position, dir, hit);
    return emission * (pdf / (pdf + other));
  }

  const World& world_;
  const LightSet& lights_;
  const LightTree tree_;
  int64_t rays_ = 0;
};

ReferenceTexel TraceTexel(PathTracer& tracer, const TexelSampler& sampler, uint32_t key, int samples) {
  ReferenceTexel result;
  std::array<Rgb, kReplicas> mean{};
  const int per_replica = samples / kReplicas;
  for (size_t r = 0; r < kReplicas; ++r) {
    PathNumbers numbers(HashCombine(key, static_cast<uint32_t>(r) + 0x4ef1u), 0);
    float count = 0;
    for (int i = 0; i < per_replica; ++i) {
      numbers.Restart(static_cast<uint32_t>(i));
      const TexelPoint point = sampler.At(numbers.Get2(0, 0));
      if (!point.valid) continue;
      count += 1;
      const Rgb sample =
          tracer.Trace(point.surface, sampler.AtMirrored(numbers.Get2(0, 0)).surface, point.frame, numbers);
      if (IsFinite(sample)) mean[r] += sample;
    }
    if (count > 0) mean[r] = mean[r] / count;
    result.irradiance += mean[r] * (1.0f / kReplicas);
    (r % 2 == 0 ? result.half_a : result.half_b) += mean[r] * (2.0f / kReplicas);
  }
  float sum = 0;
  for (const Rgb& m : mean) {
    const float d = Luminance(m - result.irradiance);
    sum += d * d;
  }
  result.standard_error = std::sqrt(sum / (kReplicas * (kReplicas - 1)));
  return result;
}

}  // namespace

std::vector<ReferenceTexel> TraceReference(const World& world, const LightSet& lights, const AtlasLayout& layout,
                                           const TexelMap& map, int samples, uint32_t seed, Progress& progress,
                                           int64_t& rays) {
  std::vector<ReferenceTexel> result(map.texels.size());
  std::atomic<int64_t> total_rays{0}, done{0};
  tbb::parallel_for(0, map.tile_count(), [&](int tile) {
    if (progress.Cancelled()) return;
    PathTracer tracer(world, lights);
    for (uint32_t i = map.tile_begin[tile]; i < map.tile_begin[tile + 1]; ++i) {
      TexelSampler sampler(world, layout, map, map.texels[i]);
      const uint32_t key = TexelKey(map.texels[i], HashCombine(seed, 0x4ef0u));
      const Surroundings around = LookAround(world, layout, map.texels[i], sampler, map.footprint);
      result[i].valid = ProbeValidity(world, map.texels[i], std::nullopt, PartSearch::kAll, around, sampler).valid;
      if (!result[i].valid) continue;
      result[i] = TraceTexel(tracer, sampler, key, samples);
    }
    total_rays += tracer.rays();
    progress.Report("reference", ++done, map.tile_count());
  });
  rays = total_rays;
  return result;
}

}  // namespace bakewell
