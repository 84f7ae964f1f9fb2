#pragma once

#include <absl/functional/function_ref.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/artifact/settings.h"
#include "core/base/status.h"
#include "core/scene/scene.h"
#include "worker/trace/glow.h"
#include "worker/trace/ray.h"
#include "worker/trace/texture.h"

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

// The scene as Embree sees it. Immutable after Build and safe to trace from any number of threads. Degenerate and
// non-finite triangles are left out. Same scene, same hits: one build thread, ISA pinned to AVX2, robust intersection.
//
// Of triangles that coincide (the same three corners, bit for bit) a ray meets the first that stops it, in this order:
// fronts (and both sides of doubleSided materials) before backs, greater emission factor before less, then the scene's
// order.
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
  // The share of the rays to one side of a triangle at barycentrics (u, v) that meet it: less than 1 where alpha lets
  // rays pass or a triangle that coincides comes first.
  float ShareMet(uint32_t triangle, float u, float v, bool back) const;
  bool IsAlwaysMet(uint32_t triangle) const { return triangle < opaque_count_; }  // ShareMet is 1 everywhere
  // Mean radiance that those rays find: EmissionAt by ShareMet.
  Rgb GlowAt(uint32_t triangle, float u, float v, bool back) const;
  bool Emits(uint32_t triangle) const;
  // Bounds of GlowAt of the sides that glow, each channel, over the hull of points of a triangle (barycentrics) that
  // reaches `most_texels` of a texture at most: those of any texture beyond that.
  GlowRange GlowOver(uint32_t triangle, std::span<const Vec2f> points, double most_texels) const;
  GlowInputs GlowInputsOf(uint32_t triangle) const;
  // How many texels of the textures that say how it glows, emission and alpha, lie along a triangle's longer edge of e1
  // and e2, about; 0 without textures.
  float GlowTexelsAcross(uint32_t triangle) const;

 private:
  static constexpr float kCutoffRounding = 1e-5f;  // alpha nearer to the cutoff may be on either side of it
  struct Device;
  struct TraceContext;
  World(const Scene& scene, BackfaceMode backfaces, float albedo_limit);
  absl::Status BuildTriangles();
  // `triangles`: all that coincide with others, by group.
  void SortGroups(std::vector<std::pair<uint32_t, uint32_t>> triangles);
  void SortByAlpha(bool look);
  absl::Status BuildDevice();
  enum Geometry : uint8_t { kStops, kAsks };
  void AddGeometry(Geometry geometry);
  // Least and most alpha over the hull of points of a triangle, as GlowOver.
  std::pair<float, float> AlphaOver(const Triangle& triangle, std::span<const Vec2f> points, double most_texels) const;
  TexelRange TexelsOver(const Triangle& triangle, const TextureRef& ref, std::span<const Vec2f> points,
                        double most_texels) const;
  uint32_t TriangleOf(uint32_t geometry, uint32_t primitive) const {
    return geometry == kStops && primitive < opaque_count_ ? primitive : of_geometry_[geometry][primitive];
  }
  static void Filter(const RTCFilterFunctionNArguments* arguments);
  // Triangles that coincide are one group; 0 is that of all which do with none, and empty.
  uint32_t GroupOf(uint32_t triangle) const {
    return triangle < opaque_count_ || triangle == kNoTriangle ? 0 : group_of_[triangle - opaque_count_];
  }
  std::span<const uint32_t> MembersOf(uint32_t group) const {
    return std::span(member_).subspan(group_begin_[group], group_begin_[group + 1] - group_begin_[group]);
  }
  template <typename Visit>
  void VisitBefore(uint32_t triangle, float u, float v, bool back, Visit visit) const;
  float OpacityAt(uint32_t triangle, float u, float v, bool back) const;
  bool Stops(uint32_t triangle, float u, float v, bool back, uint32_t key) const;
  bool IsMet(uint32_t triangle, float u, float v, Vec3f dir, uint32_t key) const;
  Rgb FrontEmissionAt(uint32_t triangle, float u, float v) const;
  Vec2f TexcoordAt(const Triangle& triangle, int set, float u, float v) const;

  const Scene& scene_;
  BackfaceMode backfaces_;
  float albedo_limit_;
  std::vector<Triangle> triangles_;  // those that are always met first
  uint32_t opaque_count_ = 0;
  // What Embree gets: triangles that stop every ray, those that Filter is asked about. What lets all rays pass or is
  // never met is in neither.
  std::array<std::vector<uint32_t>, 2> of_geometry_;
  SkipCount opaque_alpha_;
  std::vector<uint32_t> group_of_;                 // one per triangle from opaque_count_ on
  std::vector<uint32_t> member_, group_begin_{0};  // without those that are never met
  Vec3f center_;
  float radius_ = 0;
  std::unique_ptr<Device> device_;
};

}  // namespace bakewell
