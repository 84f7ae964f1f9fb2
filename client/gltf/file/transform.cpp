#include "client/gltf/file/transform.h"

#include <cmath>

namespace bakewell::gltf {
namespace {

using nlohmann::json;

Vec3d Vec3Of(const json& node, const char* name, Vec3d otherwise) {
  const auto it = node.find(name);
  if (it == node.end()) return otherwise;
  return {(*it)[0].get<double>(), (*it)[1].get<double>(), (*it)[2].get<double>()};
}

absl::StatusOr<Transform> FromMatrix(const json& matrix) {
  Transform transform;
  for (size_t c = 0; c < 4; ++c) {
    for (size_t r = 0; r < 3; ++r) transform.column[c][static_cast<int>(r)] = matrix[4 * c + r].get<double>();
    const double expected = c == 3 ? 1 : 0;
    if (std::abs(matrix[4 * c + 3].get<double>() - expected) > 1e-6) {
      return absl::InvalidArgumentError("the last row of its matrix is not 0 0 0 1");
    }
  }
  return transform;
}

}  // namespace

Vec3d Transform::Normal(Vec3d n) const {
  // The cofactor matrix is the inverse transpose times the determinant, whose sign has to be taken out again.
  const Vec3d cofactor =
      Cross(column[1], column[2]) * n.x + Cross(column[2], column[0]) * n.y + Cross(column[0], column[1]) * n.z;
  return Mirrors() ? -cofactor : cofactor;
}

bool Transform::Finite() const {
  return IsFinite(column[0]) && IsFinite(column[1]) && IsFinite(column[2]) && IsFinite(column[3]) &&
         std::isfinite(Determinant());
}

Transform operator*(const Transform& a, const Transform& b) {
  Transform product;
  for (int c = 0; c < 3; ++c) product.column[c] = a.Vector(b.column[c]);
  product.column[3] = a.Point(b.column[3]);
  return product;
}

Transform FromTrs(Vec3d translation, const double (&rotation)[4], Vec3d scale) {
  const auto [x, y, z, w] = rotation;
  Transform transform;
  transform.column[0] = Vec3d{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * scale.x;
  transform.column[1] = Vec3d{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * scale.y;
  transform.column[2] = Vec3d{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * scale.z;
  transform.column[3] = translation;
  return transform;
}

absl::StatusOr<Transform> LocalTransform(const json& node) {
  if (const auto matrix = node.find("matrix"); matrix != node.end()) return FromMatrix(*matrix);
  double q[4] = {0, 0, 0, 1};
  if (const auto it = node.find("rotation"); it != node.end()) {
    for (size_t i = 0; i < 4; ++i) q[i] = (*it)[i].get<double>();
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 1e-12 && length < 1e12)) return absl::InvalidArgumentError("its rotation is not a quaternion");
  for (double& component : q) component /= length;
  return FromTrs(Vec3Of(node, "translation", {0, 0, 0}), q, Vec3Of(node, "scale", {1, 1, 1}));
}

}  // namespace bakewell::gltf
