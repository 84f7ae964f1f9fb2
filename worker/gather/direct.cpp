#include "worker/gather/direct.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "worker/sample/mis.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr uint32_t kProbesPerLight = 8;
constexpr size_t kMostProbed = 256;    // lights; the rest count as seen
constexpr float kUnseenShare = 0.05f;  // a light that no probe saw keeps this share of its importance

}  // namespace

TileLights::TileLights(const GatherScene& scene, const TexelMap& map, uint32_t begin, uint32_t end, uint32_t key,
                       GatherCounters& counters)
    : scene_(scene), visibility_(static_cast<size_t>(scene.lights.local_count()), 1.0f) {
  if (scene.lights.local_count() < 2 || begin == end) return;
  for (const int light : WorthProbing(map, begin, end)) {
    int tried = 0, seen = 0;
    for (uint32_t i = 0; i < kProbesPerLight; ++i) {
      const Texel& texel = map.texels[begin + (end - begin) * (2 * i + 1) / (2 * kProbesPerLight)];
      const uint32_t probe_key = HashCombine(HashCombine(key, static_cast<uint32_t>(light)), i);
      const LightSample sample = scene.lights.SampleLocal(
          light, texel.position, {UnitFloat(HashCombine(probe_key, 1)), UnitFloat(HashCombine(probe_key, 2))});
      if (MaxComponent(sample.perpendicular) <= 0 || Dot(sample.dir, texel.normal) <= 0) continue;
      SurfacePoint point = scene.world.PointAt(map.fragments[texel.fragment_begin].triangle, 0, 0, false);
      point.position = texel.position;
      point.normal = texel.normal;
      ++tried;
      ++counters.shadow_rays;
      seen += scene.world.Occluded(ShadowRay(point, sample, probe_key)) ? 0 : 1;
    }
    if (tried > 0) {
      visibility_[light] = std::max(kUnseenShare, static_cast<float>(seen) / static_cast<float>(tried));
    }
  }
}

std::vector<int> TileLights::WorthProbing(const TexelMap& map, uint32_t begin, uint32_t end) const {
  std::vector<int> lights(visibility_.size());
  std::iota(lights.begin(), lights.end(), 0);
  if (lights.size() <= kMostProbed) return lights;
  Vec3f center;
  for (uint32_t i = begin; i < end; ++i) center += map.texels[i].position / static_cast<float>(end - begin);
  float radius = 0;
  for (uint32_t i = begin; i < end; ++i) radius = std::max(radius, Length(map.texels[i].position - center));
  std::vector<float> importance;
  for (const int light : lights) importance.push_back(scene_.lights.Importance(light, center, {}, radius));
  std::nth_element(lights.begin(), lights.begin() + kMostProbed, lights.end(),
                   [&](int a, int b) { return std::tuple(-importance[a], a) < std::tuple(-importance[b], b); });
  lights.resize(kMostProbed);
  return lights;
}

TileLights::Choice TileLights::ForTexel(const Texel& texel, float radius) const {
  Choice choice;
  const int count = scene_.lights.local_count();
  std::vector<float> weights;
  for (int light = 0; light < count; ++light) {
    const float importance =
        scene_.lights.Importance(light, texel.position, texel.flat ? texel.normal : Vec3f{}, radius);
    if (!(importance > 0)) continue;
    choice.light.push_back(light);
    weights.push_back(importance * visibility_[light]);
  }
  if (weights.empty()) return choice;
  choice.distribution = Distribution1D(weights);
  if (scene_.lights.emissive().empty()) return choice;
  choice.probability_of_light.assign(static_cast<size_t>(count), 0.0f);
  for (size_t i = 0; i < choice.light.size(); ++i) {
    choice.probability_of_light[choice.light[i]] = choice.distribution.Probability(static_cast<int>(i));
  }
  return choice;
}

namespace {

// One shadow ray towards `sample`; adds what arrives to the texel's sums.
class DirectAdder {
 public:
  DirectAdder(const GatherScene& scene, Accumulator& sum, GatherCounters& counters)
      : scene_(scene), sum_(sum), counters_(counters) {}

  void Add(const TexelPoint& point, const LightSample& sample, float probability, uint32_t key) {
    const float cosine = Dot(sample.dir, point.surface.normal);
    if (cosine <= 0 || MaxComponent(sample.perpendicular) <= 0) return;
    ++counters_.shadow_rays;
    if (scene_.world.Occluded(ShadowRay(point.surface, sample, key))) return;
    const float light_pdf = sample.pdf * probability;
    const float weight = sample.pdf > 0 ? PowerHeuristic(light_pdf, GatherPdf(cosine)) : 1.0f;
    const Rgb radiance_over_pdf = sample.perpendicular * (weight / probability);
    if (!IsFinite(radiance_over_pdf)) {
      ++counters_.bad_samples;
      return;
    }
    irradiance_ += radiance_over_pdf * cosine;
    sum_.AddSh(sample.dir, radiance_over_pdf);
  }

  void Finish(uint32_t index, uint32_t planned) {
    sum_.AddIrradiance(index, planned, irradiance_);
    irradiance_ = {};
  }

 private:
  const GatherScene& scene_;
  Accumulator& sum_;
  GatherCounters& counters_;
  Rgb irradiance_;
};

}  // namespace

void GatherDirect(const GatherScene& scene, const TexelSampler& sampler, const TileLights::Choice& choice, uint32_t key,
                  uint32_t begin, uint32_t end, Accumulator& sum, GatherCounters& counters) {
  const SobolSet set(HashCombine(key, 0xd12ec7u)), far_set(HashCombine(key, 0xfa25e7u));
  const EnvironmentLight& sky = scene.lights.environment();
  const bool sky_sampled = sky.bright() && !sky.smooth();
  DirectAdder adder(scene, sum, counters);
  for (uint32_t i = begin; i < end; ++i) {
    const SobolPoint u = set.At(i);
    const TexelPoint point = sampler.At(u.Get2(0));
    if (!point.valid) continue;
    sum.Count();
    const uint32_t ray_key = HashCombine(key, i);
    if (!choice.empty()) {
      const auto drawn = choice.distribution.Draw(u.Get(2));
      const int light = choice.light[drawn.index];
      adder.Add(point, scene.lights.SampleLocal(light, point.surface.position, u.Get2(3)), drawn.probability, ray_key);
    }
    const SobolPoint far = far_set.At(i);
    const TexelPoint under_sun = scene.lights.directionals().empty() ? point : sampler.AtMirrored(u.Get2(0));
    for (size_t k = 0; k < scene.lights.directionals().size(); ++k) {
      const Vec2f shift{UnitFloat(HashCombine(key, static_cast<uint32_t>(2 * k))),
                        UnitFloat(HashCombine(key, static_cast<uint32_t>(2 * k + 1)))};
      const Vec2f v = far.Get2(0) + (k == 0 ? Vec2f{} : shift);
      adder.Add(under_sun,
                scene.lights.SampleDirectional(static_cast<int>(k), {v.x - std::floor(v.x), v.y - std::floor(v.y)}), 1,
                ray_key);
    }
    if (sky_sampled) adder.Add(point, scene.lights.SampleEnvironment(far.Get2(2)), 1, ray_key);
    adder.Finish(i, end);
  }
}

}  // namespace bakewell
