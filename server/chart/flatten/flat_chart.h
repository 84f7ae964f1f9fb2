#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/mesh/surface.h"

namespace bakewell::chart {

// A connected piece of a surface laid into the plane: n faces, v vertices of its own.
struct FlatChart {
  std::vector<uint32_t> face;                  // n, faces of the Surface
  std::vector<std::array<uint32_t, 3>> corner;  // n, local vertices, counter-clockwise in the plane
  std::vector<uint32_t> vertex;                // v, vertices of the Surface, ascending
  std::vector<Vec2d> uv;                       // v, scaled units: the chart's area in the plane is its area in space
};

// The faces' own vertices, with no plane coordinates yet. O(n log n).
FlatChart LocalChart(const Surface& surface, std::span<const uint32_t> faces);

// Edges with a face of the chart on one side only, as pairs of local vertices in the direction of their face.
std::vector<std::array<uint32_t, 2>> BoundaryEdges(const Surface& surface, const FlatChart& chart);

// Twice the signed area of a face in the plane.
double SignedArea2(const FlatChart& chart, size_t face);

}  // namespace bakewell::chart
