#pragma once

#include <cmath>

#include "core/math/vec.h"

// Maps of the unit square to directions and shapes. Each says its density and measure.
namespace bakewell {

// Concentric map of the square to the unit disc (Shirley & Chiu 1997); pdf 1/pi per area.
inline Vec2f DiscFromSquare(Vec2f u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {};
  const bool wide = std::fabs(a) > std::fabs(b);
  const float r = wide ? a : b;
  const float phi = wide ? (kPiF / 4) * (b / a) : kPiF / 2 - (kPiF / 4) * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

// Unit direction about +z from its cosine, azimuth u in [0,1).
inline Vec3f DirectionFromCosine(float z, float u) {
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  const float phi = 2 * kPiF * u;
  return {r * std::cos(phi), r * std::sin(phi), z};
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

}  // namespace bakewell
