#pragma once

#include <cstdint>

#include "worker/texel/texels.h"

namespace bakewell {

// Which of its first four neighbours (kNeighbours) a texel is connected to, bit k for direction k: those of its chart
// that face about the same way, that a short ray just above the surface reaches, and that have about as much room
// above them, as far as that is less than two texels. The latter two are not asked of texels that are not `crowded`
// (Surroundings).
uint8_t ConnectTexel(const World& world, const TexelMap& map, uint32_t texel, bool crowded, int64_t& rays);

}  // namespace bakewell
