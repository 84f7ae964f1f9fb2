#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/atlas.h"

namespace bakewell::chart {

struct Soup {
  std::vector<Vec3f> position;
  std::vector<uint32_t> index;
  MeshDecl Decl() const { return {.vertexPositionData = position, .vertexUvData = {}, .indexData = index}; }
};

// A unit box, every face with vertices of its own.
Soup Box();
// An open cylinder wall, radius 1, height 2, `turn` radians of it.
Soup CylinderWall(int segments, double turn);
// A sphere of radius 1 with 2 n segments round and n from pole to pole; height stretches it.
Soup Sphere(int n, double height);

}  // namespace bakewell::chart
