#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace bakewell::chart {

inline constexpr uint32_t kNone = UINT32_MAX;

// Why an input triangle has no place in the charted surface.
enum class FaceState : uint8_t { kCharted, kDegenerate, kNonFinite };

// The usable triangles of one input mesh as an orientable 2-manifold with boundary: F faces, V vertices. Input vertices
// at one position are one vertex; edges and vertices where the input is not a manifold are split; the second and later
// copies of one triangle live on layers of their own. Positions are moved by the bounding box's centre and scaled by a
// power of two into [-1, 1], so that no later step can depend on the unit of length.
struct Surface {
  std::vector<Vec3d> position;                  // V
  std::vector<std::array<uint32_t, 3>> face;    // F, vertices, counter-clockwise seen from the front
  std::vector<std::array<uint32_t, 3>> across;  // F, the face across the edge from corner k to k+1, or kNone
  std::vector<uint32_t> source;                 // F, the input triangle
  std::vector<Vec3d> normal;                    // F, unit
  std::vector<double> area;                     // F, in scaled units
  std::vector<FaceState> state;                 // one per input triangle
  double scale = 1;                             // scaled length = scale * input length

  uint32_t FaceCount() const { return static_cast<uint32_t>(face.size()); }
  double EdgeLength(uint32_t f, int k) const { return Length(position[face[f][(k + 1) % 3]] - position[face[f][k]]); }
};

// position: input vertices; index: 3 per input triangle, each below position.size() (our bug otherwise). Any finite or
// non-finite coordinates are survived. O(n log n). Pure: the same input gives the same surface.
Surface BuildSurface(std::span<const Vec3f> position, std::span<const uint32_t> index);

}  // namespace bakewell::chart
