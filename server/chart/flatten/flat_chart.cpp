#include "server/chart/flatten/flat_chart.h"

#include <algorithm>

namespace bakewell::chart {

FlatChart LocalChart(const Surface& surface, std::span<const uint32_t> faces) {
  FlatChart chart;
  chart.face.assign(faces.begin(), faces.end());
  chart.vertex.reserve(3 * faces.size());
  for (const uint32_t f : faces) chart.vertex.insert(chart.vertex.end(), surface.face[f].begin(), surface.face[f].end());
  std::sort(chart.vertex.begin(), chart.vertex.end());
  chart.vertex.erase(std::unique(chart.vertex.begin(), chart.vertex.end()), chart.vertex.end());
  chart.corner.resize(faces.size());
  for (size_t i = 0; i < faces.size(); ++i)
    for (int k = 0; k < 3; ++k)
      chart.corner[i][k] = static_cast<uint32_t>(
          std::lower_bound(chart.vertex.begin(), chart.vertex.end(), surface.face[faces[i]][k]) - chart.vertex.begin());
  chart.uv.resize(chart.vertex.size());
  return chart;
}

std::vector<std::array<uint32_t, 2>> BoundaryEdges(const Surface& surface, const FlatChart& chart) {
  std::vector<uint32_t> members(chart.face);
  std::sort(members.begin(), members.end());
  std::vector<std::array<uint32_t, 2>> edges;
  for (size_t i = 0; i < chart.face.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const uint32_t other = surface.across[chart.face[i]][k];
      if (other == kNone || !std::binary_search(members.begin(), members.end(), other))
        edges.push_back({chart.corner[i][k], chart.corner[i][(k + 1) % 3]});
    }
  return edges;
}

double SignedArea2(const FlatChart& chart, size_t face) {
  const auto& [a, b, c] = chart.corner[face];
  return Cross(chart.uv[b] - chart.uv[a], chart.uv[c] - chart.uv[a]);
}

}  // namespace bakewell::chart
