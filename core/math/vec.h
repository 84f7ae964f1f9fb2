#pragma once

#include <algorithm>
#include <cmath>

// Small vectors for kernels: plain values, evaluated in the order written (no fused multiply-add), so that the same
// expression gives the same bits everywhere. Heavy linear algebra is Eigen's.
namespace bakewell {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr float kPiF = static_cast<float>(kPi);
inline constexpr float kInvPiF = static_cast<float>(1.0 / kPi);

template <typename T>
struct Vec2 {
  T x{}, y{};
  friend constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend constexpr Vec2 operator*(Vec2 a, T s) { return {a.x * s, a.y * s}; }
  friend constexpr Vec2 operator*(T s, Vec2 a) { return a * s; }
  friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
};

template <typename T>
constexpr T Cross(Vec2<T> a, Vec2<T> b) {
  return a.x * b.y - a.y * b.x;
}

template <typename T>
struct Vec3 {
  T x{}, y{}, z{};
  constexpr T operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
  // Componentwise, for colours.
  friend constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend constexpr Vec3 operator/(Vec3 a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  constexpr Vec3& operator-=(Vec3 b) { return *this = *this - b; }
  constexpr Vec3& operator*=(T s) { return *this = *this * s; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec2f = Vec2<float>;
using Vec2d = Vec2<double>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
// Linear colour, Rec. 709 primaries; the quantity (radiance, irradiance, flux, albedo) is in the variable's name.
using Rgb = Vec3<float>;

template <typename T>
constexpr T Dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename T>
constexpr Vec3<T> Cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename T>
T Length(Vec3<T> a) {
  return std::sqrt(Dot(a, a));
}
// The zero vector for a zero or non-finite length.
template <typename T>
Vec3<T> NormalizeOrZero(Vec3<T> a) {
  const T length = Length(a);
  return length > 0 && std::isfinite(length) ? a / length : Vec3<T>{};
}
template <typename T>
constexpr T MaxComponent(Vec3<T> a) {
  return std::max(a.x, std::max(a.y, a.z));
}
template <typename T>
bool IsFinite(Vec3<T> a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
constexpr Vec3f ToFloat(Vec3d a) { return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)}; }
constexpr Vec3d ToDouble(Vec3f a) { return {a.x, a.y, a.z}; }

// Rec. 709 luminance (theory.md 1).
constexpr float Luminance(Rgb c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

// A right-handed orthonormal frame; local z is `n`.
struct Frame {
  Vec3f t, b, n;
  constexpr Vec3f ToWorld(Vec3f v) const { return t * v.x + b * v.y + n * v.z; }
  constexpr Vec3f ToLocal(Vec3f v) const { return {Dot(v, t), Dot(v, b), Dot(v, n)}; }
};

// The frame around unit `n` whose tangent is the part of `hint` that is perpendicular to n: a frame that turns with its
// geometry. Falls back to FrameFromNormal where the hint is parallel to n.
Frame FrameFromHint(Vec3f n, Vec3f hint);

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3.
inline Frame FrameFromNormal(Vec3f n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

inline Frame FrameFromHint(Vec3f n, Vec3f hint) {
  const Vec3f t = NormalizeOrZero(hint - n * Dot(n, hint));
  if (Dot(t, t) < 0.5f) return FrameFromNormal(n);
  return {t, Cross(n, t), n};
}

}  // namespace bakewell
