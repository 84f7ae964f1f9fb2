#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace bakewell {

// Corner 0, 1 or 2 of triangle `k` of an object.
inline Vec3f CornerOf(const Object& object, uint32_t k, size_t corner) {
  return object.position[object.index[3 * static_cast<size_t>(k) + corner]];
}

// A triangle that has its three corners, bit for bit and in whatever order, in common with others of its group.
struct Coincident {
  uint64_t number = 0;  // among the triangles of all objects, in the scene's order
  uint32_t group = 0;   // counted from 0
};

// All whose corners are numbers, by Coincident::number. Takes 12 bytes a triangle of the scene while it looks, and
// O(n log n) whatever the corners.
std::vector<Coincident> FindCoincident(const Scene& scene);

}  // namespace bakewell
