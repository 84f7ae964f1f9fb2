#include "server/chart/flatten/stretch.h"

#include <cmath>

namespace bakewell::chart {
namespace {

// (sigma1^2 + sigma2^2) of the affine map from the plane to space, from edge vectors: the squared Frobenius norm.
double SquaredStretch(const Surface& surface, const FlatChart& chart, size_t i) {
  const auto& [a, b, c] = chart.corner[i];
  const Vec2d u = chart.uv[b] - chart.uv[a], v = chart.uv[c] - chart.uv[a];
  const Vec3d p = surface.position[chart.vertex[a]];
  const Vec3d e = surface.position[chart.vertex[b]] - p, f = surface.position[chart.vertex[c]] - p;
  const double d = Cross(u, v);
  const Vec3d ds = (e * v.y - f * u.y) / d, dt = (f * u.x - e * v.x) / d;
  return Dot(ds, ds) + Dot(dt, dt);
}

}  // namespace

Stretch MeasureStretch(const Surface& surface, const FlatChart& chart) {
  double area_space = 0, area_plane = 0, sum = 0;
  for (size_t i = 0; i < chart.face.size(); ++i) {
    if (IsFlipped(chart, i)) return {.flipped = true, .l2 = INFINITY};
    area_space += surface.area[chart.face[i]];
    area_plane += SignedArea2(chart, i) / 2;
    sum += surface.area[chart.face[i]] * SquaredStretch(surface, chart, i) / 2;
  }
  return {.flipped = false, .l2 = std::sqrt(sum / area_space * (area_plane / area_space))};
}

void NormalizeArea(const Surface& surface, FlatChart& chart) {
  double area_space = 0, area_plane = 0;
  for (size_t i = 0; i < chart.face.size(); ++i) {
    area_space += surface.area[chart.face[i]];
    area_plane += SignedArea2(chart, i) / 2;
  }
  const double factor = std::sqrt(area_space / area_plane);
  for (Vec2d& uv : chart.uv) uv = uv * factor;
}

}  // namespace bakewell::chart
