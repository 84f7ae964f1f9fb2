#include "worker/gather/path.h"

#include <limits>

#include "worker/gather/direct.h"
#include "worker/sample/hash.h"
#include "worker/sample/mis.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kMostNear = 4, kMostBounces = 64;  // bounces: of hits that are near, and of all
// A first hit nearer than this many neighbourhood widths continues the path; a later one nearer than this many sides of
// a cell, as between the walls of a gap that cells cannot tell from what is outside it.
constexpr float kNearWidths = 1.5f, kGapSides = 0.5f;

float Random(uint32_t key, uint32_t what) { return UnitFloat(HashCombine(key, what)); }

Rgb Arriving(const GatherScene& scene, const SurfacePoint& point, const LightSample& sample, float probability,
             uint32_t key, GatherCounters& counters) {
  const float cosine = Dot(sample.dir, point.normal);
  if (cosine <= 0 || MaxComponent(sample.perpendicular) <= 0 || probability <= 0) return {};
  ++counters.shadow_rays;
  if (scene.world.Occluded(ShadowRay(point, sample, key))) return {};
  const float light_pdf = sample.pdf * probability;
  const float weight = sample.pdf > 0 ? PowerHeuristic(light_pdf, cosine * kInvPiF) : 1.0f;
  return sample.perpendicular * (cosine * weight / probability);
}

}  // namespace

void GatherCounters::Add(const GatherCounters& other) {
  gather_rays += other.gather_rays;
  shadow_rays += other.shadow_rays;
  bounce_rays += other.bounce_rays;
  validity_rays += other.validity_rays;
  filter_rays += other.filter_rays;
  bad_samples += other.bad_samples;
  distant_found += other.distant_found;
  skip.Add(other.skip);
}

Rgb SampleDirect(const GatherScene& scene, const TileLights* lights, const SurfacePoint& point, uint32_t key,
                 GatherCounters& counters) {
  Rgb irradiance;
  if (!scene.tree.empty()) {
    const LightTree::Pick pick =
        lights ? lights->DrawNear(point, Random(key, 1))
               : scene.tree.Draw(LightTree::kRoot, {point.position, point.normal}, Random(key, 1));
    if (pick.light >= 0) {
      const LightSample sample = scene.lights.SampleLocal(pick.light, point.position, {Random(key, 2), Random(key, 3)});
      irradiance += Arriving(scene, point, sample, pick.probability, key, counters);
    }
  }
  for (size_t i = 0; i < scene.lights.directionals().size(); ++i) {
    const uint32_t k = static_cast<uint32_t>(2 * i);
    const LightSample sample =
        scene.lights.SampleDirectional(static_cast<int>(i), {Random(key, 16 + k), Random(key, 17 + k)});
    irradiance += Arriving(scene, point, sample, 1, key, counters);
  }
  const EnvironmentLight& sky = scene.lights.environment();
  if (sky.bright() && !sky.smooth()) {
    const LightSample sample = scene.lights.SampleEnvironment({Random(key, 4), Random(key, 5)});
    irradiance += Arriving(scene, point, sample, 1, key, counters);
  }
  return irradiance;
}

GatheredRadiance ReflectedRadiance(const GatherScene& scene, const TileLights* lights, const Hit& first, uint32_t key,
                                   GatherCounters& counters) {
  GatheredRadiance result;
  Rgb throughput{1, 1, 1};
  Hit hit = first;
  for (int bounce = 0;; ++bounce) {
    const Rgb albedo = scene.world.AlbedoAt(hit);
    throughput = throughput * albedo * kInvPiF;
    if (MaxComponent(throughput) <= 0) return result;
    const SurfacePoint point = scene.world.PointAt(hit);
    const CachedLight& cached = CacheAt(scene, point, hit.back);
    const uint32_t step_key = HashCombine(key, static_cast<uint32_t>(bounce));
    const float side = scene.cells.patches()[scene.cells.PatchOf(hit.triangle)].cell_side_m;
    const float reach = bounce == 0 ? kNearWidths * static_cast<float>(cached.window) : kGapSides;
    const bool near = hit.t < reach * side;
    if (cached.window != 0 && (!near || bounce >= kMostNear)) {
      const Rgb reflected = throughput * cached.irradiance;
      result.radiance += reflected;
      const float unit = Luminance(reflected) / CachedLight::kShareUnit;
      for (size_t g = 0; g < kVarianceGroups; ++g) result.group[g] = unit * static_cast<float>(cached.group_share[g]);
      return result;
    }
    if (bounce >= kMostNear) {
      const float survive = MaxComponent(albedo);
      if (bounce == kMostBounces || Random(step_key, 10) >= survive) return result;
      throughput = throughput / survive;
    }
    result.radiance += throughput * SampleDirect(scene, lights, point, step_key, counters);
    const Frame frame = FrameFromHint(point.normal, scene.world.triangles()[hit.triangle].e1);
    const Vec3f dir = frame.ToWorld(CosineHemisphere({Random(step_key, 8), Random(step_key, 9)}));
    ++counters.bounce_rays;
    const Hit next = scene.world.Intersect(RayFrom(point, dir, kInfinity, step_key));
    throughput = throughput * kPiF;  // cosine lobe: irradiance is pi times the radiance found
    const float pdf = std::max(0.0f, Dot(dir, point.normal)) * kInvPiF;
    result.radiance += throughput * FoundByRay(scene, point, dir, pdf, next, [&](int light) {
                         return lights
                                    ? lights->ProbabilityNear(point, light)
                                    : scene.tree.Probability(LightTree::kRoot, light, {point.position, point.normal});
                       });
    if (!next) return result;
    hit = next;
  }
}

}  // namespace bakewell
