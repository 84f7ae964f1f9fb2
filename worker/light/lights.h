#pragma once

#include <vector>

#include "worker/light/emission_patterns.h"
#include "worker/light/environment.h"
#include "worker/light/pack.h"
#include "worker/trace/world.h"

namespace bakewell {

// A triangle that emits, with the mean radiance of what glows: its front, or both sides (World::GlowAt).
struct EmissiveTriangle {
  uint32_t triangle = 0;
  float area = 0;  // [m^2]
  Rgb mean_radiance;
  bool two_sided = false;
  int table = -1;  // LightSet::TableOf; -1: it glows evenly, about
};

// Light that arrives at a point from one sampled point of one light, before visibility.
struct LightSample {
  Vec3f dir;     // unit, towards the light
  Vec3f target;  // where the shadow ray ends (finite lights)
  uint32_t target_triangle = kNoTriangle;
  bool infinite = false;  // the shadow ray has no end
  Rgb perpendicular;      // irradiance on a plane facing the light, divided by the pdf of the point [W m^-2]
  float pdf = 0;          // per steradian, given the light; 0 for a delta light
};

// Every light of a scene. Local lights are numbered: punctual ones that are not directional, then emissive triangles.
// Immutable, thread safe.
class LightSet {
 public:
  LightSet(const World& world, const Environment& environment);

  int local_count() const { return static_cast<int>(locals_.size() + emissive_.size()); }
  const std::vector<PunctualLight>& locals() const { return locals_; }
  const std::vector<PunctualLight>& directionals() const { return directionals_; }
  const std::vector<EmissiveTriangle>& emissive() const { return emissive_; }
  const EnvironmentLight& environment() const { return environment_; }
  const World& world() const { return world_; }
  // Directional lights, or a sky that is not smooth.
  bool samples_distant() const { return !directionals_.empty() || (environment_.bright() && !environment_.smooth()); }
  bool IsEmissive(int light) const { return light >= static_cast<int>(locals_.size()); }

  // The local light of an emissive triangle, or -1: of those that coincide, the ones that rays meet are lights.
  int LightOfTriangle(uint32_t triangle) const;

  // Null where a triangle glows evenly, about, or has no table because very many others want one.
  const EmissionTable* TableOf(const EmissiveTriangle& light) const {
    return light.table < 0 ? nullptr : &patterns_.table(light.table);
  }

  // A point of local light `light` as seen from `position`. pdf: uniform in solid angle for near triangles, in area for
  // far ones; those with a table by that, near ones in part. As PdfLocal says.
  LightSample SampleLocal(int light, Vec3f position, Vec2f u) const;
  // Density per steradian with which SampleLocal draws the point where a ray from `position` along unit `dir` meets
  // the light's triangle: the hit's distance and barycentrics.
  float PdfLocal(int light, Vec3f position, Vec3f dir, const Hit& hit) const;
  LightSample SampleDirectional(int directional, Vec2f u) const;
  LightSample SampleEnvironment(Vec2f u) const;

  // What a local light looks like to a choice among many.
  LightShape ShapeOf(int light) const;
  // Radiated flux (luminance) [W].
  float Power(int light) const;

 private:
  struct Disc {
    Frame across;  // n: towards the light
    float sin_radius = 0;
  };
  LightSample SampleTriangle(const EmissiveTriangle& light, Vec3f position, Vec2f u) const;
  float Pdf(const EmissiveTriangle& light, float solid_angle, Vec2f barycentrics, float cos_light,
            float distance) const;

  const World& world_;
  EmissionPatterns patterns_;
  std::vector<PunctualLight> locals_, directionals_;
  std::vector<Disc> discs_;  // of the directional lights
  std::vector<EmissiveTriangle> emissive_;
  std::vector<int> light_of_triangle_;  // one per triangle, empty where nothing emits
  EnvironmentLight environment_;
};

// clamp((cos t - cos outer)/(cos inner - cos outer), 0, 1)^2, KHR_lights_punctual's recommendation; 1 for point lights.
float SpotFalloff(const PunctualLight& light, float cos_angle);

// The shadow ray from a surface point to a light sample.
Ray ShadowRay(const SurfacePoint& from, const LightSample& sample, uint32_t key);

}  // namespace bakewell
