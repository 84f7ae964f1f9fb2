#pragma once

#include <absl/functional/function_ref.h>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/artifact/settings.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

struct RTCFilterFunctionNArguments;

namespace bakewell {

// One triangle in the scene's frame (relative to Scene::origin_ws) [m].
struct Triangle {
  Vec3f p0, e1, e2;  // corners p0, p0 + e1, p0 + e2
  Vec3f normal;      // unit, geometric, front side
  uint32_t object = 0;
  uint32_t index_in_object = 0;
  uint16_t material = 0;
};

inline constexpr uint32_t kNoTriangle = ~0u;

struct Ray {
  Vec3f origin;
  Vec3f dir;                                      // unit
  float t_max;                                    // [m], infinity allowed
  uint32_t key = 0;                               // decides what a BLEND surface lets through
  uint32_t from = kNoTriangle, to = kNoTriangle;  // the triangles that it starts and ends on, if any: never hit
};

// The first surface along a ray; triangle == kNoTriangle where there is none.
struct Hit {
  uint32_t triangle = kNoTriangle;
  float t = 0;         // [m]
  float u = 0, v = 0;  // barycentrics of e1 and e2
  bool back = false;   // the ray meets the back side
  explicit operator bool() const { return triangle != kNoTriangle; }
};

// A point to start rays from, on one side of a triangle.
struct SurfacePoint {
  Vec3f position;
  Vec3f normal;      // unit, geometric, on the side that is meant
  float offset = 0;  // how far along `normal` a ray must start to miss its own surface [m]
  uint32_t triangle = kNoTriangle;
};

// The scene as Embree sees it. Immutable after Build and safe to trace from any number of threads. Degenerate and
// non-finite triangles are left out. Same scene, same hits: one build thread, ISA pinned to AVX2, robust intersection.
class World {
 public:
  static absl::StatusOr<std::unique_ptr<World>> Build(const Scene& scene, BackfaceMode backfaces, float albedo_limit,
                                                      const SkipSet& no_skip = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Hit Intersect(const Ray& ray) const;
  bool Occluded(const Ray& ray) const;
  // Triangles whose bounds meet a sphere, in no particular order, until `visit` returns false.
  void VisitNear(Vec3f center, float radius, absl::FunctionRef<bool(uint32_t triangle)> visit) const;

  const Scene& scene() const { return scene_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  BackfaceMode backfaces() const { return backfaces_; }
  // Sphere around all vertices, centred at their mean [m].
  Vec3f center() const { return center_; }
  float radius() const { return radius_; }

  // Triangles whose alpha is the same to every ray, so that none looks it up, of those of materials with alpha.
  const SkipCount& opaque_alpha() const { return opaque_alpha_; }

  const Material& MaterialOf(const Triangle& triangle) const { return scene_.materials[triangle.material]; }
  // The point at a hit, on the side the ray came from.
  SurfacePoint PointAt(const Hit& hit) const;
  SurfacePoint PointAt(uint32_t triangle, float u, float v, bool back) const;
  // Diffuse albedo at a hit, in [0, albedo_limit]; zero on back faces that absorb.
  Rgb AlbedoAt(const Hit& hit) const;
  // Emitted radiance towards the ray [W m^-2 sr^-1]: the front, and the back of doubleSided materials.
  Rgb EmissionAt(const Hit& hit) const;
  // Radiance emitted by the front of a triangle at barycentrics (u, v).
  Rgb FrontEmissionAt(uint32_t triangle, float u, float v) const;
  bool Emits(uint32_t triangle) const;

 private:
  struct Device;
  struct TraceContext;
  World(const Scene& scene, BackfaceMode backfaces, float albedo_limit);
  absl::Status BuildTriangles();
  void SortByAlpha(bool look);
  absl::Status BuildDevice();
  enum Geometry : uint8_t { kStops, kAsks };
  void AddGeometry(Geometry geometry);
  std::pair<float, float> AlphaRange(const Triangle& triangle) const;  // least and most
  uint32_t TriangleOf(uint32_t geometry, uint32_t primitive) const {
    return geometry == kStops && primitive < opaque_count_ ? primitive : of_geometry_[geometry][primitive];
  }
  static void Filter(const RTCFilterFunctionNArguments* arguments);
  bool Passes(uint32_t triangle, float u, float v, Vec3f dir, uint32_t key) const;
  Vec2f TexcoordAt(const Triangle& triangle, int set, float u, float v) const;

  const Scene& scene_;
  BackfaceMode backfaces_;
  float albedo_limit_;
  std::vector<Triangle> triangles_;  // those of opaque materials first
  uint32_t opaque_count_ = 0;
  // What Embree gets: triangles that stop every ray, those that Filter is asked about. What lets all rays pass is in
  // neither.
  std::array<std::vector<uint32_t>, 2> of_geometry_;
  SkipCount opaque_alpha_;
  Vec3f center_;
  float radius_ = 0;
  std::unique_ptr<Device> device_;
};

// Where a ray that leaves `point` along its side's normal starts. The offset is an error bound of the position and of
// the intersection (Wächter & Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection"), relative to the
// triangle's coordinates: no absolute epsilon.
// Needles, whose plane rounding tilts by more than that, are told apart by number (Ray::from).
inline Vec3f RayOrigin(const SurfacePoint& point) { return point.position + point.normal * point.offset; }

inline Ray RayFrom(const SurfacePoint& point, Vec3f dir, float t_max, uint32_t key) {
  return {RayOrigin(point), dir, t_max, key, point.triangle};
}

}  // namespace bakewell
