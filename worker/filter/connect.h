#pragma once

#include <cstdint>

#include "worker/texel/texels.h"

namespace bakewell {

inline constexpr float kSameFacing = 0.9f;  // least cosine between the normals of connected texels

// Whether a short ray just above the surface goes from one texel to another, and both have about as much room above
// them, as far as that is less than two texels. sides: between their positions, of texels.
bool LiesOpen(const World& world, const Texel& a, const Texel& b, float sides, int64_t& rays);

// Which of its first four neighbours (kNeighbours) a texel is connected to, bit k for direction k: those of its chart
// that face about the same way, and that lie open to it. The latter is not asked of texels that are not `crowded`
// (Surroundings).
uint8_t ConnectTexel(const World& world, const TexelMap& map, uint32_t texel, bool crowded, int64_t& rays);

}  // namespace bakewell
