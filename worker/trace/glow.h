#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "core/math/vec.h"
#include "worker/trace/ray.h"

namespace bakewell {

inline constexpr std::array<Vec2f, 3> kTriangleCorners{Vec2f{0, 0}, Vec2f{1, 0}, Vec2f{0, 1}};  // barycentrics

// Bounds of radiance, each channel [W m^-2 sr^-1].
struct GlowRange {
  Rgb least, most;
};

// What the radiance of a triangle's points depends on: those with the same glow alike.
struct GlowInputs {
  uint32_t material = 0;
  uint32_t coincides = kNoTriangle;  // itself, where others coincide with it
  std::array<Vec2f, 3> emission_uv{}, alpha_uv{};

  friend bool operator==(const GlowInputs&, const GlowInputs&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const GlowInputs& inputs) {
    for (const auto* uv : {&inputs.emission_uv, &inputs.alpha_uv}) {
      for (const Vec2f p : *uv) h = H::combine(std::move(h), p.x, p.y);
    }
    return H::combine(std::move(h), inputs.material, inputs.coincides);
  }
};

}  // namespace bakewell
