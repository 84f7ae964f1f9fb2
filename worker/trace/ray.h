#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace bakewell {

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

// Where a ray that leaves `point` along its side's normal starts. The offset is an error bound of the position and of
// the intersection (Wächter & Binder 2019, "A Fast and Robust Method for Avoiding Self-Intersection"), relative to the
// triangle's coordinates: no absolute epsilon.
// Needles, whose plane rounding tilts by more than that, are told apart by number (Ray::from).
inline Vec3f RayOrigin(const SurfacePoint& point) { return point.position + point.normal * point.offset; }

inline Ray RayFrom(const SurfacePoint& point, Vec3f dir, float t_max, uint32_t key) {
  return {RayOrigin(point), dir, t_max, key, point.triangle};
}

}  // namespace bakewell
