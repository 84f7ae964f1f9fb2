#include "server/chart/flatten/laplacian.h"

#include <algorithm>

namespace bakewell::chart {
namespace {

// Slivers: an angle's cotangent is held within what a factorisation in doubles resolves.
constexpr double kMaxCotangent = 1e4;

}  // namespace

std::vector<PlanarFace> PlanarFaces(const Surface& surface, const FlatChart& chart) {
  std::vector<PlanarFace> faces(chart.face.size());
  for (size_t i = 0; i < faces.size(); ++i) {
    std::array<Vec3d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = surface.position[chart.vertex[chart.corner[i][k]]];
    const Vec3d e = p[1] - p[0], f = p[2] - p[0];
    const double length = Length(e), twice_area = 2 * surface.area[chart.face[i]];
    faces[i].corner = {Vec2d{0, 0}, Vec2d{length, 0}, Vec2d{Dot(e, f) / length, twice_area / length}};
    for (int k = 0; k < 3; ++k) {
      const Vec3d apex = p[(k + 2) % 3];
      const double cotangent = Dot(p[k] - apex, p[(k + 1) % 3] - apex) / twice_area;
      faces[i].half_cotangent[k] = std::clamp(cotangent, -kMaxCotangent, kMaxCotangent) / 2;
    }
  }
  return faces;
}

void AddSquaredDifference(Entries& entries, int i, int j, double weight) {
  entries.emplace_back(i, i, weight);
  entries.emplace_back(j, j, weight);
  entries.emplace_back(std::max(i, j), std::min(i, j), -weight);
}

}  // namespace bakewell::chart
