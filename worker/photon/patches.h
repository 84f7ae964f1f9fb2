#pragma once

#include <cstdint>
#include <vector>

#include "worker/trace/world.h"

namespace bakewell {

// Groups triangles into connected patches whose normals stay within 35 degrees of the patch's first triangle.
// Neighbours share an edge by exact position, run opposite ways; edges of more than two triangles separate. Every
// triangle is in exactly one patch; triangles of a patch are in breadth-first order. Deterministic.
std::vector<std::vector<uint32_t>> GrowPatches(const World& world);

}  // namespace bakewell
