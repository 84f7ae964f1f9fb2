#include "worker/gather/direct.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/sample/mis.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr uint32_t kProbesPerNode = 8;
constexpr float kUnseenShare = 0.05f;  // of a light that no probe saw is taken to be visible
constexpr double kMostUnseen = 4;      // light, over that of lights that were seen
constexpr float kLeastHeld = 1e-6f;    // share of such light that is left

// A sphere around the texels' centres.
LitPlace Around(std::span<const Texel> texels) {
  LitPlace place;
  for (const Texel& texel : texels) place.position += texel.position / static_cast<float>(texels.size());
  for (const Texel& texel : texels) place.radius = std::max(place.radius, Length(texel.position - place.position));
  return place;
}

}  // namespace

TileLights::TileLights(const GatherScene& scene, const TexelMap& map, uint32_t begin, uint32_t end, uint32_t key,
                       float dispensable, GatherCounters& counters)
    : scene_(scene) {
  if (scene.tree.empty() || begin == end) return;
  const std::span<const Texel> texels = std::span(map.texels).subspan(begin, end - begin);
  const int all = scene.lights.local_count();
  if (!scene.lights.emissive().empty()) cut_of_light_.assign(static_cast<size_t>(all), -1);
  const LitPlace place = Around(texels);
  const std::vector<int> cut = scene.tree.Cut(place, LightPack::kMost);
  const std::vector<int> kept = scene.tree.Cull(cut, place, dispensable);
  SkipCount& culled = counters.skip[Skip::kCulledLights];
  for (size_t i = 0, k = 0; i < cut.size(); ++i) {
    const int node = cut[i];
    const bool keep = k < kept.size() && kept[k] == node;
    k += keep ? 1 : 0;
    const std::span<const int> lights = scene.tree.LightsOf(node);
    culled.of += std::ssize(lights);
    culled.skipped += keep ? 0 : std::ssize(lights);
    if (!cut_of_light_.empty()) {
      for (const int light : lights) cut_of_light_[static_cast<size_t>(light)] = static_cast<int>(i);
    }
    if (!keep) {
      cut_.push_back({node, false});
    } else {
      cut_.push_back(all < 2 ? Node{node} : Probe(node, texels, map, key, counters));
    }
  }
  HoldBackUnseen(place);
  std::vector<LightShape> shapes;
  for (const Node& node : cut_) {
    shapes.push_back(scene.tree.ShapeOf(node.node));
    shapes.back().intensity *= node.visibility;
  }
  pack_ = LightPack(shapes);
}

// A few lamps in a room below a stadium's: those that no probe saw must not take all samples.
void TileLights::HoldBackUnseen(const LitPlace& place) {
  double seen = 0, unseen = 0;
  for (const Node& node : cut_) {
    (node.seen ? seen : unseen) += static_cast<double>(scene_.tree.Importance(node.node, place) * node.visibility);
  }
  if (!(seen > 0 && unseen > kMostUnseen * seen)) return;
  const float share = std::max(kLeastHeld, static_cast<float>(kMostUnseen * seen / unseen));
  for (Node& node : cut_) node.visibility *= node.seen ? 1 : share;
}

TileLights::Node TileLights::Probe(int node, std::span<const Texel> texels, const TexelMap& map, uint32_t key,
                                   GatherCounters& counters) const {
  int tried = 0, seen = 0;
  for (uint32_t i = 0; i < kProbesPerNode; ++i) {
    const Texel& texel = texels[texels.size() * (2 * i + 1) / (2 * kProbesPerNode)];
    const uint32_t first = static_cast<uint32_t>(scene_.tree.LightsOf(node)[0]);
    const uint32_t probe_key = HashCombine(HashCombine(key, first), i);
    SurfacePoint point = scene_.world.PointAt(map.fragments[texel.fragment_begin].triangle, 0, 0, false);
    point.position = texel.position;
    point.normal = texel.normal;
    const LightTree::Pick pick =
        scene_.tree.Draw(node, {point.position, point.normal}, UnitFloat(HashCombine(probe_key, 3)));
    if (pick.light < 0) continue;
    const LightSample sample = scene_.lights.SampleLocal(
        pick.light, point.position, {UnitFloat(HashCombine(probe_key, 1)), UnitFloat(HashCombine(probe_key, 2))});
    if (MaxComponent(sample.perpendicular) <= 0 || Dot(sample.dir, point.normal) <= 0) continue;
    ++tried;
    ++counters.shadow_rays;
    seen += scene_.world.Occluded(ShadowRay(point, sample, probe_key)) ? 0 : 1;
  }
  if (tried == 0) return {node, true, false, 1};
  // The root of the share: what counts is the mean of the square of what a sample brings.
  const float share = static_cast<float>(seen) / static_cast<float>(tried);
  return {node, true, seen > 0, std::sqrt(std::max(kUnseenShare, share))};
}

TileLights::Choice TileLights::ForTexel(const Texel& texel, float radius) const {
  Choice choice;
  if (cut_.empty()) return choice;
  LightPack::Weights weights;
  pack_.Weigh({texel.position, texel.flat ? texel.normal : Vec3f{}, radius}, 0, cut_.size(), weights);
  double seen = 0, unseen = 0;
  for (size_t i = 0; i < cut_.size(); ++i) {
    const Node& node = cut_[i];
    if (!node.kept) weights.of[i] = 0;
    choice.unoccluded += weights.of[i] / node.visibility;
    choice.empty = choice.empty && !(weights.of[i] > 0);
    (node.seen ? seen : unseen) += static_cast<double>(weights.of[i]);
  }
  // Lights that no probe saw, however bright, get no more samples than those that were seen.
  if (seen > 0 && unseen > seen) {
    const float share = std::max(std::numeric_limits<float>::min(), static_cast<float>(seen / unseen));
    for (size_t i = 0; i < cut_.size(); ++i) weights.of[i] *= cut_[i].seen ? 1 : share;
  }
  if (!choice.empty) choice.distribution = Distribution1D(std::span(weights.of).first(cut_.size()));
  return choice;
}

LightTree::Pick TileLights::Draw(const Choice& choice, const SurfacePoint& point, float u) const {
  const auto drawn = choice.distribution.Draw(u);
  LightTree::Pick pick =
      scene_.tree.Draw(cut_[static_cast<size_t>(drawn.index)].node, {point.position, point.normal}, drawn.remainder);
  pick.probability *= drawn.probability;
  return pick;
}

float TileLights::Probability(const Choice& choice, const SurfacePoint& point, int light) const {
  if (choice.empty) return 0;
  const int at = cut_of_light_[static_cast<size_t>(light)];
  if (at < 0) return 0;
  const float chosen = choice.distribution.Probability(at);
  if (!(chosen > 0)) return 0;
  return chosen * scene_.tree.Probability(cut_[static_cast<size_t>(at)].node, light, {point.position, point.normal});
}

LightTree::Pick TileLights::DrawNear(const SurfacePoint& point, float u) const {
  LightPack::Weights weights;
  pack_.Weigh({point.position, point.normal}, 0, cut_.size(), weights);
  const DrawnWeight drawn = DrawWeight(weights, cut_.size(), u);
  if (drawn.index < 0) return {};
  LightTree::Pick pick =
      scene_.tree.Draw(cut_[static_cast<size_t>(drawn.index)].node, {point.position, point.normal}, drawn.remainder);
  pick.probability *= drawn.probability;
  return pick;
}

float TileLights::ProbabilityNear(const SurfacePoint& point, int light) const {
  LightPack::Weights weights;
  pack_.Weigh({point.position, point.normal}, 0, cut_.size(), weights);
  if (!(weights.total > 0)) return 0;
  const auto at = static_cast<size_t>(cut_of_light_[static_cast<size_t>(light)]);
  const float chosen = weights.of[at] / weights.total;
  if (!(chosen > 0)) return 0;
  return chosen * scene_.tree.Probability(cut_[at].node, light, {point.position, point.normal});
}

namespace {

// One shadow ray towards `sample`; adds what arrives to the texel's sums.
class DirectAdder {
 public:
  DirectAdder(const GatherScene& scene, Accumulator& sum, GatherCounters& counters)
      : scene_(scene), sum_(sum), counters_(counters) {}

  // False where nothing arrives.
  bool Add(const TexelPoint& point, const LightSample& sample, float probability, uint32_t key) {
    const float cosine = Dot(sample.dir, point.surface.normal);
    if (cosine <= 0 || MaxComponent(sample.perpendicular) <= 0) return false;
    ++counters_.shadow_rays;
    if (scene_.world.Occluded(ShadowRay(point.surface, sample, key))) return false;
    const float light_pdf = sample.pdf * probability;
    const float weight = sample.pdf > 0 ? PowerHeuristic(light_pdf, GatherPdf(cosine)) : 1.0f;
    const Rgb radiance_over_pdf = sample.perpendicular * (weight / probability);
    if (!IsGoodSample(radiance_over_pdf)) {
      ++counters_.bad_samples;
      return true;
    }
    irradiance_ += radiance_over_pdf * cosine;
    sum_.AddSh(sample.dir, radiance_over_pdf);
    return true;
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

void GatherDirect(const GatherScene& scene, const TexelSampler& sampler, const TileLights& lights,
                  const TileLights::Choice& choice, Distant distant, uint32_t key, uint32_t begin, uint32_t end,
                  Accumulator& sum, GatherCounters& counters) {
  const SobolSet set(HashCombine(key, 0xd12ec7u)), far_set(HashCombine(key, 0xfa25e7u));
  const EnvironmentLight& sky = scene.lights.environment();
  const bool sky_sampled = distant == Distant::kSampled && sky.bright() && !sky.smooth();
  const size_t suns = distant == Distant::kSampled ? scene.lights.directionals().size() : 0;
  DirectAdder adder(scene, sum, counters);
  for (uint32_t i = begin; i < end; ++i) {
    const SobolPoint u = set.At(i);
    const TexelPoint point = sampler.At(u.Get2(0));
    if (!point.valid) continue;
    sum.Count();
    const uint32_t ray_key = HashCombine(key, i);
    if (!choice.empty) {
      const LightTree::Pick pick = lights.Draw(choice, point.surface, u.Get(2));
      if (pick.light >= 0) {
        adder.Add(point, scene.lights.SampleLocal(pick.light, point.surface.position, u.Get2(3)), pick.probability,
                  ray_key);
      }
    }
    const SobolPoint far = far_set.At(i);
    const TexelPoint under_sun = suns == 0 ? point : sampler.AtMirrored(u.Get2(0));
    for (size_t k = 0; k < suns; ++k) {
      const Vec2f shift{UnitFloat(HashCombine(key, static_cast<uint32_t>(2 * k))),
                        UnitFloat(HashCombine(key, static_cast<uint32_t>(2 * k + 1)))};
      const Vec2f v = far.Get2(0) + (k == 0 ? Vec2f{} : shift);
      const LightSample sample =
          scene.lights.SampleDirectional(static_cast<int>(k), {v.x - std::floor(v.x), v.y - std::floor(v.y)});
      counters.distant_found += adder.Add(under_sun, sample, 1, ray_key) ? 1 : 0;
    }
    if (sky_sampled) {
      counters.distant_found += adder.Add(point, scene.lights.SampleEnvironment(far.Get2(2)), 1, ray_key) ? 1 : 0;
    }
    adder.Finish(i, end);
  }
}

Rgb FoundByGather(const GatherScene& scene, const TileLights* lights, const TileLights::Choice& choice,
                  const SurfacePoint& from, Vec3f dir, float pdf, const Hit& hit) {
  return FoundByRay(scene, from, dir, pdf, hit,
                    [&](int light) { return lights ? lights->Probability(choice, from, light) : 0; });
}

}  // namespace bakewell
