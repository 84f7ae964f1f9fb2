#pragma once

#include "core/artifact/skip.h"
#include "worker/light/tree.h"
#include "worker/photon/cache.h"
#include "worker/sample/mis.h"

namespace bakewell {

class BrightnessPyramid;
class TileLights;

// What the gather reads; all of it immutable.
struct GatherScene {
  const World& world;
  const LightSet& lights;
  const LightTree& tree;
  const SurfaceCells& cells;
  const RadianceCache& cache;
  const BrightnessPyramid* brightness = nullptr;  // of the cache; none: no gather ray is aimed
};

// What the cache knows at a point of the scene's surface.
inline const CachedLight& CacheAt(const GatherScene& scene, const SurfacePoint& point, bool back) {
  return scene.cache
      .light[2 * static_cast<size_t>(scene.cells.CellAt(point.triangle, point.position)) + (back ? 1 : 0)];
}

struct GatherCounters {
  int64_t gather_rays = 0, shadow_rays = 0, bounce_rays = 0, validity_rays = 0, filter_rays = 0, bad_samples = 0;
  int64_t distant_found = 0;  // samples of suns and sky that arrived; reported to nobody
  SkipTally skip;
  int64_t light_rays() const { return gather_rays + shadow_rays + bounce_rays; }
  void Add(const GatherCounters& other);
};

// Light that one gather ray brings back.
struct GatheredRadiance {
  Rgb radiance;                                // reflected at the hit (emission is the caller's)
  std::array<float, kVarianceGroups> group{};  // luminance of the part that photons contributed, by photon group
};

// Radiance reflected towards a gather ray's origin at `hit`, `distance` away: direct light sampled at the hit plus the
// cache's indirect light; where the hit is nearer than a few bandwidths, or the cell is cut by other geometry, one
// further bounce instead (theory.md 3, step 2). `key` decides all random numbers. lights: of the tile whose texel
// gathers; none: no place is known.
GatheredRadiance ReflectedRadiance(const GatherScene& scene, const TileLights* lights, const Hit& hit, uint32_t key,
                                   GatherCounters& counters);

// Direct irradiance at a surface point by light sampling: one local light, every directional light, the sky where it is
// not smooth. With multiple importance sampling (power heuristic) against a cosine lobe for lights
// that a bounce can hit.
Rgb SampleDirect(const GatherScene& scene, const TileLights* lights, const SurfacePoint& point, uint32_t key,
                 GatherCounters& counters);

// Radiance that a ray of density `pdf` finds by itself, emission and sky, weighted against samples of lights that are
// drawn with chosen(light).
template <typename Chosen>
Rgb FoundByRay(const GatherScene& scene, const SurfacePoint& from, Vec3f dir, float pdf, const Hit& hit,
               Chosen chosen) {
  if (!hit) {
    const EnvironmentLight& sky = scene.lights.environment();
    if (!sky.bright()) return {};
    return sky.Radiance(dir) * (sky.smooth() ? 1.0f : PowerHeuristic(pdf, sky.Pdf(dir)));
  }
  const int light = scene.lights.LightOfTriangle(hit.triangle);
  if (light < 0) return {};
  const Rgb emission = scene.world.EmissionAt(hit);
  if (MaxComponent(emission) <= 0) return {};
  const float probability = chosen(light);
  const float light_pdf = probability > 0 ? probability * scene.lights.PdfLocal(light, from.position, dir, hit) : 0;
  return emission * PowerHeuristic(pdf, light_pdf);
}

}  // namespace bakewell
