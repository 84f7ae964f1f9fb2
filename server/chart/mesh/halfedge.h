#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace bakewell::chart {

// What OpenMesh made of a triangle list: the triangles with the vertices that it had to duplicate, and who is across
// each edge.
struct HalfEdgeResult {
  std::vector<std::array<uint32_t, 3>> face;    // F, vertices
  std::vector<std::array<uint32_t, 3>> across;  // F, the face across the edge from corner k to k+1, or UINT32_MAX
  std::vector<uint32_t> origin;                 // V, the input vertex that each vertex is a copy of
};

// Builds OpenMesh's half-edge structure of F triangles over vertex_count vertices. A triangle that would make an edge
// or a vertex non-manifold gets copies of the vertices concerned, so every triangle is in. Threads may call it
// concurrently.
HalfEdgeResult BuildHalfEdges(std::span<const std::array<uint32_t, 3>> triangle, uint32_t vertex_count);

}  // namespace bakewell::chart
