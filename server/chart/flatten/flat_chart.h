#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/mesh/surface.h"

namespace bakewell::chart {

// A connected piece of a surface laid into the plane: n faces, v vertices of its own. A vertex whose faces the chart's
// border parts into several fans is one local vertex per fan, so every local vertex has at most two border edges.
struct FlatChart {
  std::vector<uint32_t> face;                   // n, faces of the Surface
  std::vector<std::array<uint32_t, 3>> corner;  // n, local vertices, counter-clockwise in the plane
  std::vector<uint32_t> vertex;                 // v, vertices of the Surface
  std::vector<Vec2d> uv;                        // v, scaled units: the chart's area in the plane is its area in space
};

// The faces' own vertices, with no plane coordinates yet. O(n log n).
FlatChart LocalChart(const Surface& surface, std::span<const uint32_t> faces);

// An edge with a face of the chart on one side only, in the direction of its face.
struct BoundaryEdge {
  uint32_t a, b;  // local vertices
  uint32_t face;  // 0 .. n-1
};

// Ordered by face.
std::vector<BoundaryEdge> BoundaryEdges(const Surface& surface, const FlatChart& chart);

// Faces that edges inside the set connect, each part ascending, parts by their first face. O(n log n).
std::vector<std::vector<uint32_t>> ConnectedParts(const Surface& surface, std::span<const uint32_t> faces);

// Whether a face is turned over in the plane, or too thin there to have a side.
bool IsFlipped(const FlatChart& chart, size_t face);

// Twice the signed area of a face in the plane.
double SignedArea2(const FlatChart& chart, size_t face);

}  // namespace bakewell::chart
