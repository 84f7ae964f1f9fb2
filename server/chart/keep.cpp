#include "server/chart/keep.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

namespace bakewell {
namespace {

// How far outside the page rounding in an exporter may take a UV [texels].
constexpr float kOutsideTexels = 0.01f;

absl::StatusOr<std::vector<TexelUv>> PageUvs(const Object& object, PageSize page) {
  if (object.uv1.size() != object.position.size())
    return absl::InvalidArgumentError("object '" + object.name +
                                      "' has no TEXCOORD_1 to keep; bake with --uv generate");
  const float width = static_cast<float>(page.width), height = static_cast<float>(page.height);
  std::vector<TexelUv> uv;
  uv.reserve(object.uv1.size());
  for (size_t v = 0; v < object.uv1.size(); ++v) {
    const float x = object.uv1[v].x * width, y = object.uv1[v].y * height;
    const bool inside =
        x >= -kOutsideTexels && y >= -kOutsideTexels && x <= width + kOutsideTexels && y <= height + kOutsideTexels;
    if (!inside)  // also catches what is not finite
      return absl::InvalidArgumentError("object '" + object.name + "': TEXCOORD_1 of vertex " + std::to_string(v) +
                                        " is not inside the page; bake with --uv generate");
    uv.push_back({std::clamp(x, 0.0f, width), std::clamp(y, 0.0f, height)});
  }
  return uv;
}

struct UvEdge {
  std::array<float, 4> key;   // the UVs of both ends, the lesser end first
  std::array<float, 6> ends;  // the positions of both ends, in the same order
  uint32_t triangle;
};

UvEdge MakeEdge(const Object& object, const std::vector<TexelUv>& uv, uint32_t a, uint32_t b, uint32_t triangle) {
  if (std::tie(uv[b].x, uv[b].y) < std::tie(uv[a].x, uv[a].y)) std::swap(a, b);
  const Vec3f p = object.position[a], q = object.position[b];
  return {{uv[a].x, uv[a].y, uv[b].x, uv[b].y}, {p.x, p.y, p.z, q.x, q.y, q.z}, triangle};
}

bool HasArea(const Object& object, const std::vector<TexelUv>& uv, uint32_t t) {
  const uint32_t a = object.index[3 * t], b = object.index[3 * t + 1], c = object.index[3 * t + 2];
  const Vec2d u{double(uv[b].x) - uv[a].x, double(uv[b].y) - uv[a].y};
  const Vec2d v{double(uv[c].x) - uv[a].x, double(uv[c].y) - uv[a].y};
  const Vec3d p = ToDouble(object.position[a]);
  const double area_space = Length(Cross(ToDouble(object.position[b]) - p, ToDouble(object.position[c]) - p));
  return Cross(u, v) != 0 && area_space > 0 && std::isfinite(area_space);
}

std::vector<UvEdge> SortedEdges(const Object& object, const std::vector<TexelUv>& uv) {
  std::vector<UvEdge> edges;
  for (uint32_t t = 0; t < object.index.size() / 3; ++t) {
    if (!HasArea(object, uv, t)) continue;
    for (uint32_t k = 0; k < 3; ++k)
      edges.push_back(MakeEdge(object, uv, object.index[3 * t + k], object.index[3 * t + (k + 1) % 3], t));
  }
  std::sort(edges.begin(), edges.end(), [](const UvEdge& a, const UvEdge& b) {
    return std::tie(a.key, a.ends, a.triangle) < std::tie(b.key, b.ends, b.triangle);
  });
  return edges;
}

uint32_t Find(std::vector<uint32_t>& parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Numbers UV-connected triangles from `first_chart` on, in the order of their first triangle.
std::vector<int32_t> ConnectedCharts(const Object& object, const std::vector<TexelUv>& uv, int32_t first_chart) {
  const uint32_t triangles = static_cast<uint32_t>(object.index.size() / 3);
  std::vector<uint32_t> parent(triangles);
  std::iota(parent.begin(), parent.end(), 0u);
  const std::vector<UvEdge> edges = SortedEdges(object, uv);
  for (size_t i = 1; i < edges.size(); ++i) {
    if (edges[i].key != edges[i - 1].key || edges[i].ends != edges[i - 1].ends) continue;
    const uint32_t a = Find(parent, edges[i - 1].triangle), b = Find(parent, edges[i].triangle);
    parent[std::max(a, b)] = std::min(a, b);
  }
  std::vector<int32_t> chart(triangles, kNoChart), number(triangles, kNoChart);
  for (uint32_t t = 0; t < triangles; ++t) {
    if (!HasArea(object, uv, t)) continue;
    int32_t& root = number[Find(parent, t)];
    if (root == kNoChart) root = first_chart++;
    chart[t] = root;
  }
  return chart;
}

// Sums over all charted triangles, for the mean density.
struct Areas {
  double page = 0, space = 0;
};

void AddAreas(const Object& object, const ObjectCharts& charts, Areas& areas) {
  for (size_t t = 0; t < charts.chart_of_triangle.size(); ++t) {
    if (charts.chart_of_triangle[t] == kNoChart) continue;
    const uint32_t a = object.index[3 * t], b = object.index[3 * t + 1], c = object.index[3 * t + 2];
    const Vec3d p = ToDouble(object.position[a]);
    areas.space += Length(Cross(ToDouble(object.position[b]) - p, ToDouble(object.position[c]) - p)) / 2;
    const TexelUv u = charts.uv[a], v = charts.uv[b], w = charts.uv[c];
    areas.page +=
        std::abs(Cross(Vec2d{double(v.x) - u.x, double(v.y) - u.y}, Vec2d{double(w.x) - u.x, double(w.y) - u.y})) / 2;
  }
}

}  // namespace

absl::StatusOr<AtlasLayout> KeepCharts(const Scene& scene, PageSize page) {
  if (page.width <= 0 || page.height <= 0) return absl::InvalidArgumentError("the lightmap page has no size");
  AtlasLayout layout;
  layout.pages = {page};
  layout.objects.resize(scene.objects.size());
  Areas areas;
  for (size_t o = 0; o < scene.objects.size(); ++o) {
    const Object& object = scene.objects[o];
    if (!object.lightmapped) continue;
    ObjectCharts& charts = layout.objects[o];
    BAKEWELL_ASSIGN_OR_RETURN(charts.uv, PageUvs(object, page));
    charts.xref.resize(object.position.size());
    std::iota(charts.xref.begin(), charts.xref.end(), 0u);
    charts.index = object.index;
    charts.chart_of_triangle = ConnectedCharts(object, charts.uv, static_cast<int32_t>(layout.charts.size()));
    for (const int32_t chart : charts.chart_of_triangle)
      if (chart >= static_cast<int32_t>(layout.charts.size())) layout.charts.push_back({0, static_cast<int>(o)});
    AddAreas(object, charts, areas);
  }
  if (areas.space > 0) layout.texels_per_metre = static_cast<float>(std::sqrt(areas.page / areas.space));
  return layout;
}

}  // namespace bakewell
