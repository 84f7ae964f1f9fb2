#include "server/chart/flatten/project.h"

#include "core/base/check.h"

namespace bakewell::chart {
namespace {

Vec3d MeanNormal(const Surface& surface, const FlatChart& chart) {
  Vec3d sum{0, 0, 0};
  for (const uint32_t f : chart.face) sum += surface.normal[f] * surface.area[f];
  const Vec3d mean = NormalizeOrZero(sum);
  return Dot(mean, mean) > 0 ? mean : surface.normal[chart.face[0]];
}

// The coordinate axis that is most perpendicular to n, made perpendicular.
Vec3d TangentOf(Vec3d n) {
  const Vec3d a{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const Vec3d axis = a.x <= a.y && a.x <= a.z ? Vec3d{1, 0, 0} : a.z <= a.y ? Vec3d{0, 0, 1} : Vec3d{0, 1, 0};
  return NormalizeOrZero(axis - n * Dot(axis, n));
}

}  // namespace

void ProjectOnMeanPlane(const Surface& surface, FlatChart& chart) {
  const Vec3d normal = MeanNormal(surface, chart), s = TangentOf(normal), t = Cross(normal, s);
  const Vec3d origin = surface.position[chart.vertex[0]];
  for (size_t v = 0; v < chart.vertex.size(); ++v) {
    const Vec3d p = surface.position[chart.vertex[v]] - origin;
    chart.uv[v] = {Dot(p, s), Dot(p, t)};
  }
}

void LayTriangle(const Surface& surface, FlatChart& chart) {
  BAKEWELL_CHECK_OP(chart.face.size(), ==, 1u);
  const auto& corner = chart.corner[0];
  const uint32_t f = chart.face[0];
  int k = 0;
  for (int i = 1; i < 3; ++i)
    if (surface.EdgeLength(f, i) > surface.EdgeLength(f, k)) k = i;
  const uint32_t a = corner[k], b = corner[(k + 1) % 3], c = corner[(k + 2) % 3];
  const Vec3d p = surface.position[chart.vertex[a]];
  const double length = surface.EdgeLength(f, k);
  const Vec3d along = (surface.position[chart.vertex[b]] - p) / length;
  chart.uv[a] = {0, 0};
  chart.uv[b] = {length, 0};
  chart.uv[c] = {Dot(surface.position[chart.vertex[c]] - p, along), 2 * surface.area[f] / length};
}

}  // namespace bakewell::chart
