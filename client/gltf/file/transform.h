#pragma once

#include <nlohmann/json.hpp>

#include "core/base/status.h"
#include "core/math/vec.h"

namespace bakewell::gltf {

// An affine map in double precision: x -> column[0] x.x + column[1] x.y + column[2] x.z + column[3].
struct Transform {
  Vec3d column[4] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};

  Vec3d Point(Vec3d p) const { return Vector(p) + column[3]; }
  Vec3d Vector(Vec3d v) const { return column[0] * v.x + column[1] * v.y + column[2] * v.z; }
  double Determinant() const { return Dot(column[0], Cross(column[1], column[2])); }
  // Turns a triangle's winding around.
  bool Mirrors() const { return Determinant() < 0; }
  // The direction of inverse-transpose(linear part) n, not normalised; also where the linear part has rank 2.
  Vec3d Normal(Vec3d n) const;
  bool Finite() const;
};

Transform operator*(const Transform& a, const Transform& b);

// Translation, unit quaternion (x, y, z, w), scale.
Transform FromTrs(Vec3d translation, const double (&rotation)[4], Vec3d scale);

// The local transform of a node that passed CheckSchema. kInvalidArgument for a quaternion of length zero, or a matrix
// whose last row is not 0 0 0 1; messages do not name the node.
absl::StatusOr<Transform> LocalTransform(const nlohmann::json& node);

}  // namespace bakewell::gltf
