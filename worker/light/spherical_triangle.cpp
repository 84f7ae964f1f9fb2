#include "worker/light/spherical_triangle.h"

#include <cmath>

namespace bakewell {
namespace {

// The unit part of `x` perpendicular to unit `y` (Arvo's [x | y]).
Vec3f Perpendicular(Vec3f x, Vec3f y) { return NormalizeOrZero(x - y * Dot(x, y)); }

}  // namespace

SphericalTriangle::SphericalTriangle(Vec3f a, Vec3f b, Vec3f c) : a_(a), b_(b), c_(c) {
  // a . (b x c), with differences so that small triangles keep their digits.
  const float volume = std::fabs(Dot(a, Cross(b - a, c - a)));
  solid_angle_ = 2 * std::atan2(volume, 1 + Dot(a, b) + Dot(b, c) + Dot(c, a));
}

Vec3f SphericalTriangle::Draw(Vec2f u) const {
  const Vec3f normal_ab = NormalizeOrZero(Cross(a_, b_)), normal_ac = NormalizeOrZero(Cross(a_, c_));
  const float cos_alpha = std::clamp(Dot(normal_ab, normal_ac), -1.0f, 1.0f);
  const float sin_alpha = std::sqrt(1 - cos_alpha * cos_alpha);
  const float alpha = std::acos(cos_alpha);
  const float area = u.x * solid_angle_;
  const float s = std::sin(area - alpha), t = std::cos(area - alpha);
  const float p = t - cos_alpha, v = s + sin_alpha * Dot(a_, b_);
  const float denominator = (v * s + p * t) * sin_alpha;
  const float q = denominator != 0 ? std::clamp(((v * t - p * s) * cos_alpha - v) / denominator, -1.0f, 1.0f) : 1.0f;
  const Vec3f c_hat = a_ * q + Perpendicular(c_, a_) * std::sqrt(1 - q * q);
  const float z = 1 - u.y * (1 - Dot(c_hat, b_));
  return NormalizeOrZero(b_ * z + Perpendicular(c_hat, b_) * std::sqrt(std::max(0.0f, 1 - z * z)));
}

}  // namespace bakewell
