#include "worker/gather/outlook.h"

#include <array>
#include <limits>
#include <vector>

#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr uint32_t kRays = 16;  // of one set

using Groups = std::array<double, kVarianceGroups>;

// What one set of rays finds.
struct Found {
  Groups deviation{};          // of each group of photons from the mean of all
  double sum = 0, square = 0;  // of the rays' irradiance, luminance
};

Found Gather(const GatherScene& scene, const TexelPoint& point, uint32_t key, GatherCounters& counters) {
  const SobolSet set(key);
  Found found;
  for (uint32_t i = 0; i < kRays; ++i) {
    const Vec3f local = CosineHemisphere(set.At(i).Get2(0)), dir = point.frame.ToWorld(local);
    const uint32_t ray_key = HashCombine(key, i);
    ++counters.gather_rays;
    const Hit hit = scene.world.Intersect(RayFrom(point.surface, dir, std::numeric_limits<float>::infinity(), ray_key));
    Rgb radiance = FoundByRay(scene, point.surface, dir, local.z * kInvPiF, hit, [&](int light) {
      return scene.tree.Probability(LightTree::kRoot, light, {point.surface.position, point.surface.normal});
    });
    if (hit) {
      const GatheredRadiance reflected = ReflectedRadiance(scene, nullptr, hit, ray_key, counters);
      radiance += reflected.radiance;
      for (size_t g = 0; g < found.deviation.size(); ++g) {
        found.deviation[g] += kPi * static_cast<double>(reflected.group[g]) / kRays;
      }
    }
    const double irradiance = kPi * static_cast<double>(Luminance(radiance));
    found.sum += irradiance;
    found.square += irradiance * irradiance;
  }
  double mean = 0;
  for (const double group : found.deviation) mean += group / kVarianceGroups;
  for (double& group : found.deviation) group -= mean;
  return found;
}

double IrradianceAt(const GatherScene& scene, const SurfacePoint& point) {
  return static_cast<double>(Luminance(CacheAt(scene, point, false).irradiance));
}

}  // namespace

GatherOutlook LookAhead(const GatherScene& scene, std::span<const TexelPoint> points, float floor_share,
                        uint32_t seed) {
  std::vector<double> irradiance;
  double mean = 0;
  for (const TexelPoint& point : points) {
    irradiance.push_back(IrradianceAt(scene, point.surface));
    mean += irradiance.back() / static_cast<double>(points.size());
  }
  GatherOutlook outlook;
  if (!(mean > 0)) return outlook;
  GatherCounters counters;
  for (size_t i = 0; i < points.size(); ++i) {
    const uint32_t key = HashCombine(HashCombine(seed, 0x9401u), static_cast<uint32_t>(i));
    const Found a = Gather(scene, points[i], key, counters),
                b = Gather(scene, points[i], HashCombine(key, 1), counters);
    double covariance = 0;
    for (size_t g = 0; g < kVarianceGroups; ++g) {
      covariance += a.deviation[g] * b.deviation[g] / (kVarianceGroups * (kVarianceGroups - 1));
    }
    const double n = 2 * kRays, sum = a.sum + b.sum, variance = (a.square + b.square - sum * sum / n) / (n - 1);
    const double unit = mean * std::max(irradiance[i], static_cast<double>(floor_share) * mean);
    outlook.photon_variance += covariance / unit / static_cast<double>(points.size());
    outlook.ray_variance += variance / unit / static_cast<double>(points.size());
  }
  outlook.photon_variance = std::max(0.0, outlook.photon_variance);
  outlook.bounces = static_cast<double>(counters.bounce_rays) / static_cast<double>(counters.gather_rays);
  return outlook;
}

}  // namespace bakewell
