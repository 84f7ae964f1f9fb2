#pragma once

#include <array>
#include <span>

#include "core/sh/sh.h"

namespace bakewell {

// Spherical harmonics cut off at l = 2 ring: opposite a strong light the irradiance that they stand for is below zero,
// by up to 16 % of its mean. A window of w_l = 1 / (1 + strength (l (l + 1))^2) takes that away and blurs the rest (the
// minimum of the squared Laplacian, Sloan 2008, Stupid Spherical Harmonics Tricks).

// A strength for each of up to kRingingLanes texels, whatever the others are: one that keeps the irradiance
// (IrradianceFromSh) of every channel above -kMostRinging of its mean for all normals, and the least above
// -0.9 kMostRinging of it by no more; 0 where none is needed.
inline constexpr double kMostRinging = 0.01;
inline constexpr size_t kRingingLanes = 8;
std::array<double, kRingingLanes> WindowStrengths(std::span<const RadianceSh* const> batch);

RadianceSh Windowed(const RadianceSh& sh, double strength);

}  // namespace bakewell
