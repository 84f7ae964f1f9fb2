#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/atlas/layout.h"
#include "core/math/vec.h"

namespace bakewell::chart {

// Page coordinates in texels as floats, inside [0, page]. Rounding may turn over a triangle that is thinner than a
// float resolves: one of its corners is then moved by a few units in the last place, so that it and its neighbours have
// no negative area. corner: faces as triples of vertices; position: one per vertex.
std::vector<TexelUv> RoundToFloat(std::span<const std::array<uint32_t, 3>> corner, std::span<const Vec2d> position,
                                  Vec2d page);

}  // namespace bakewell::chart
