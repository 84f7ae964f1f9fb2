#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace bakewell::chart {

// Cuts a triangle soup into a manifold's vertices. triangle: F welded vertex triples, no two corners equal; layer: F,
// triangles of different layers never meet; normal: F unit normals, which decide who continues whom where more than
// two triangles share an edge (the flattest pair first). Two triangles are joined only where they run along their edge
// in opposite directions. Returns F triples of new vertices: corners keep one vertex only if a fan of joined triangles
// links them, and no vertex has more than 256 corners (a hub of a million triangles must not cost its square).
std::vector<std::array<uint32_t, 3>> SplitNonManifold(std::span<const std::array<uint32_t, 3>> triangle,
                                                      std::span<const uint32_t> layer, std::span<const Vec3d> normal);

}  // namespace bakewell::chart
