#pragma once

#include "core/sh/sh.h"

namespace bakewell {

// Spherical harmonics cut off at l = 2 ring: opposite a strong light the irradiance that they stand for is below zero,
// by up to 16 % of its mean. A window of w_l = 1 / (1 + strength (l (l + 1))^2) takes that away and blurs the rest (the
// minimum of the squared Laplacian, Sloan 2008, Stupid Spherical Harmonics Tricks).

// The least strength that keeps the irradiance (IrradianceFromSh) of every channel above -kMostRinging of its mean, for
// all normals; 0 where none is needed.
inline constexpr double kMostRinging = 0.01;
double WindowStrength(const RadianceSh& sh);

RadianceSh Windowed(const RadianceSh& sh, double strength);

}  // namespace bakewell
