#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"

namespace bakewell::chart {

struct RandomMesh {
  std::vector<Vec3f> position;
  std::vector<uint32_t> index;
};

// Mesh number `key` of an endless sequence: soups, grids, fans and shells with slivers, duplicate, turned and zero-area
// triangles, unused vertices, vertices at NaN and infinity, at scales from 1e-6 to 1e6. The same key gives the same
// mesh everywhere.
RandomMesh MakeRandomMesh(uint64_t key);

}  // namespace bakewell::chart
