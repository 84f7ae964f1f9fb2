#include "worker/light/spherical_triangle.h"

#include <cmath>

namespace bakewell {
namespace {

// The unit part of `x` perpendicular to unit `y` (Arvo's [x | y]).
Vec3d Perpendicular(Vec3d x, Vec3d y) { return NormalizeOrZero(x - y * Dot(x, y)); }

Vec3d Unit(Vec3f a) { return NormalizeOrZero(ToDouble(a)); }

}  // namespace

SphericalTriangle::SphericalTriangle(Vec3f a, Vec3f b, Vec3f c) : a_(a), b_(b), c_(c) {
  // a . (b x c), with differences so that small triangles keep their digits.
  const Vec3d x = Unit(a), y = Unit(b), z = Unit(c);
  const double volume = std::fabs(Dot(x, Cross(y - x, z - x)));
  solid_angle_ = 2 * std::atan2(volume, 1 + Dot(x, y) + Dot(y, z) + Dot(z, x));
}

// In double: the formula subtracts nearly equal sines, and in single precision the points of a triangle of a hundredth
// of a steradian end up a tenth of a per cent off (seen against Lambert's contour formula).
Vec3f SphericalTriangle::Draw(Vec2f u) const {
  const Vec3d a = Unit(a_), b = Unit(b_), c = Unit(c_);
  const Vec3d normal_ab = NormalizeOrZero(Cross(a, b)), normal_ac = NormalizeOrZero(Cross(a, c));
  const double cos_alpha = std::clamp(Dot(normal_ab, normal_ac), -1.0, 1.0);
  const double sin_alpha = Length(Cross(normal_ab, normal_ac));
  // sin and cos of (area - alpha) without the angle alpha.
  const double area = static_cast<double>(u.x) * solid_angle_;
  const double sin_area = std::sin(area), cos_area = std::cos(area);
  const double s = sin_area * cos_alpha - cos_area * sin_alpha, t = cos_area * cos_alpha + sin_area * sin_alpha;
  const double p = t - cos_alpha, v = s + sin_alpha * Dot(a, b);
  const double denominator = (v * s + p * t) * sin_alpha;
  const double q = denominator != 0 ? std::clamp(((v * t - p * s) * cos_alpha - v) / denominator, -1.0, 1.0) : 1.0;
  const Vec3d c_hat = a * q + Perpendicular(c, a) * std::sqrt(1 - q * q);
  const double z = 1 - static_cast<double>(u.y) * (1 - Dot(c_hat, b));
  return ToFloat(NormalizeOrZero(b * z + Perpendicular(c_hat, b) * std::sqrt(std::max(0.0, 1 - z * z))));
}

}  // namespace bakewell
