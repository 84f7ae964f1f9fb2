#pragma once

#include <cmath>

#include "core/math/vec.h"

// Maps of the unit square to directions and shapes. Each says its density and measure.
namespace bakewell {

// Cosine and sine of an eighth of a turn at most, |x| <= pi/4 [rad], to 1e-7: Taylor series, the same on every machine.
inline Vec2f CircleNear(float x) {
  const float z = x * x;
  const float c = 1 - z * (1.0f / 2 - z * (1.0f / 24 - z * (1.0f / 720 - z * (1.0f / 40320))));
  const float s = x * (1 - z * (1.0f / 6 - z * (1.0f / 120 - z * (1.0f / 5040 - z * (1.0f / 362880)))));
  return {c, s};
}

// The point of the unit circle at `turns` of a whole turn, in [0, 1].
inline Vec2f Circle(float turns) {
  const int quarter = static_cast<int>(4 * turns + 0.5f);
  const Vec2f p = CircleNear((4 * turns - static_cast<float>(quarter)) * (kPiF / 2));
  const Vec2f q = quarter & 1 ? Vec2f{-p.y, p.x} : p;
  return quarter & 2 ? Vec2f{-q.x, -q.y} : q;
}

// Concentric map of the square to the unit disc (Shirley & Chiu 1997); pdf 1/pi per area.
inline Vec2f DiscFromSquare(Vec2f u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {};
  const bool wide = std::fabs(a) > std::fabs(b);
  const float r = wide ? a : b, other = wide ? b : a;
  const Vec2f p = CircleNear((kPiF / 4) * (other / r));
  return wide ? Vec2f{r * p.x, r * p.y} : Vec2f{r * p.y, r * p.x};
}

// Unit direction about +z from its cosine, azimuth u in [0,1).
inline Vec3f DirectionFromCosine(float z, float u) {
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  const Vec2f p = Circle(u);
  return {r * p.x, r * p.y, z};
}

// Cosine-weighted hemisphere about +z; pdf z/pi per steradian.
inline Vec3f CosineHemisphere(Vec2f u) {
  const Vec2f d = DiscFromSquare(u);
  return {d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y))};
}

// Uniform sphere; pdf 1/(4 pi) per steradian.
inline Vec3f UniformSphere(Vec2f u) { return DirectionFromCosine(1 - 2 * u.x, u.y); }

// The lobe of a gather ray: kGatherCosineShare of a cosine lobe, the rest uniform, as one smooth map, so that sums of
// L Y_i (no cosine, unbounded variance under a pure cosine lobe) and of L cos both stay quiet.
inline constexpr float kGatherCosineShare = 0.75f;

// pdf per steradian of GatherHemisphere at a direction of cosine z >= 0.
inline float GatherPdf(float z) { return (kGatherCosineShare * z + (1 - kGatherCosineShare) * 0.5f) * kInvPiF; }

// Direction about +z with density GatherPdf: inverts the CDF a z^2 + (1 - a) z of the cosine.
inline Vec3f GatherHemisphere(Vec2f u) {
  constexpr float a = kGatherCosineShare;
  const float z = (std::sqrt((1 - a) * (1 - a) + 4 * a * u.x) - (1 - a)) / (2 * a);
  return DirectionFromCosine(std::min(z, 1.0f), u.y);
}

// The u.x with which GatherHemisphere gives a direction of cosine z; u.y is its azimuth over 2 pi.
inline float GatherRow(float z) { return z * (kGatherCosineShare * z + 1 - kGatherCosineShare); }

// Barycentrics (u of e1, v of e2), uniform over a triangle (Heitz 2019, low-distortion map).
inline Vec2f TriangleFromSquare(Vec2f u) {
  float a = u.x, b = u.y;
  if (b > a) {
    a *= 0.5f;
    b -= a;
  } else {
    b *= 0.5f;
    a -= b;
  }
  return {a, b};
}

// The point of the square that TriangleFromSquare takes to barycentrics `b`.
inline Vec2f SquareFromTriangle(Vec2f b) { return b.y > b.x ? Vec2f{2 * b.x, b.x + b.y} : Vec2f{b.x + b.y, 2 * b.y}; }

}  // namespace bakewell
