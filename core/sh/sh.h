#pragma once

#include <array>

#include "core/math/vec.h"

namespace bakewell {

inline constexpr int kShCoefficients = 9;

// Real orthonormal spherical harmonics to l = 2, index l(l+1)+m, no Condon-Shortley sign (theory.md 2; Kautz' listing).
// `dir_ws` is unit.
constexpr std::array<float, kShCoefficients> EvaluateSh(Vec3f dir_ws) {
  const auto [x, y, z] = dir_ws;
  return {0.28209479f,
          0.48860251f * y,
          0.48860251f * z,
          0.48860251f * x,
          1.09254843f * x * y,
          1.09254843f * y * z,
          0.31539157f * (3.0f * z * z - 1.0f),
          1.09254843f * x * z,
          0.54627422f * (x * x - y * y)};
}

// Coefficients lambda_i = integral L(w) Y_i(w) dw of incident radiance [W m^-2], world frame, one set per channel.
struct RadianceSh {
  std::array<Rgb, kShCoefficients> lambda{};
};

// Cosine-lobe weights A_l per coefficient: pi, 2pi/3, pi/4 (Ramamoorthi & Hanrahan 2001).
inline constexpr std::array<float, kShCoefficients> kCosineLobe = {3.14159265f, 2.09439510f, 2.09439510f,
                                                                   2.09439510f, 0.78539816f, 0.78539816f,
                                                                   0.78539816f, 0.78539816f, 0.78539816f};

// E(n) = sum_i A_l lambda_i Y_i(n) [W m^-2]: the band-limited irradiance, which rings where l > 2 matters.
constexpr Rgb IrradianceFromSh(const RadianceSh& sh, Vec3f normal_ws) {
  const auto basis = EvaluateSh(normal_ws);
  Rgb irradiance{};
  for (int i = 0; i < kShCoefficients; ++i) irradiance += sh.lambda[i] * (kCosineLobe[i] * basis[i]);
  return irradiance;
}

}  // namespace bakewell
