#pragma once

#include "core/math/vec.h"

namespace bakewell {

// A triangle as seen from a point: directions to its corners, its solid angle and uniform sampling of it.
// Arvo 1995, "Stratified Sampling of Spherical Triangles"; solid angle by Van Oosterom & Strackee 1983.
class SphericalTriangle {
 public:
  // a, b, c: unit directions to the corners.
  SphericalTriangle(Vec3f a, Vec3f b, Vec3f c);
  float solid_angle() const { return solid_angle_; }  // [sr], >= 0
  // Unit direction, density 1/solid_angle per steradian.
  Vec3f Draw(Vec2f u) const;

 private:
  Vec3f a_, b_, c_;
  float solid_angle_ = 0;
};

}  // namespace bakewell
