#include "server/chart/flatten/flat_chart.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace bakewell::chart {

namespace {

// A face thinner than this share of its longest edge squared flips by rounding alone.
constexpr double kFlatShare = 1e-14;

// Faces of a chart by place in a sorted list: a chart is small beside its surface.
class Members {
 public:
  explicit Members(std::span<const uint32_t> faces) : place_(faces.size()) {
    for (uint32_t i = 0; i < faces.size(); ++i) place_[i] = {faces[i], i};
    std::sort(place_.begin(), place_.end());
  }
  uint32_t IndexOf(uint32_t face) const {
    const auto it = std::lower_bound(place_.begin(), place_.end(), std::pair{face, 0u});
    return it != place_.end() && it->first == face ? it->second : kNone;
  }

 private:
  std::vector<std::pair<uint32_t, uint32_t>> place_;
};

uint32_t Find(std::vector<uint32_t>& parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void Join(std::vector<uint32_t>& parent, uint32_t a, uint32_t b) {
  a = Find(parent, a), b = Find(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

// Which corner of face g is vertex v.
uint32_t CornerOf(const Surface& surface, uint32_t g, uint32_t v) {
  return surface.face[g][0] == v ? 0 : surface.face[g][1] == v ? 1 : 2;
}

// Corners that an inner edge of the chart links get one root.
std::vector<uint32_t> CornerFans(const Surface& surface, std::span<const uint32_t> faces, const Members& members) {
  std::vector<uint32_t> parent(3 * faces.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (uint32_t i = 0; i < faces.size(); ++i)
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t other = surface.across[faces[i]][k], j = other == kNone ? kNone : members.IndexOf(other);
      if (j == kNone || j < i) continue;
      for (const uint32_t c : {k, (k + 1) % 3})
        Join(parent, 3 * i + c, 3 * j + CornerOf(surface, other, surface.face[faces[i]][c]));
    }
  return parent;
}

}  // namespace

FlatChart LocalChart(const Surface& surface, std::span<const uint32_t> faces) {
  FlatChart chart;
  chart.face.assign(faces.begin(), faces.end());
  chart.corner.resize(faces.size());
  std::vector<uint32_t> fan = CornerFans(surface, faces, Members(faces)), number(3 * faces.size(), kNone);
  for (uint32_t c = 0; c < fan.size(); ++c) {
    uint32_t& local = number[Find(fan, c)];
    if (local == kNone) {
      local = static_cast<uint32_t>(chart.vertex.size());
      chart.vertex.push_back(surface.face[faces[c / 3]][c % 3]);
    }
    chart.corner[c / 3][c % 3] = local;
  }
  chart.uv.resize(chart.vertex.size());
  return chart;
}

std::vector<BoundaryEdge> BoundaryEdges(const Surface& surface, const FlatChart& chart) {
  const Members members(chart.face);
  std::vector<BoundaryEdge> edges;
  for (uint32_t i = 0; i < chart.face.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const uint32_t other = surface.across[chart.face[i]][k];
      if (other == kNone || members.IndexOf(other) == kNone)
        edges.push_back({chart.corner[i][k], chart.corner[i][(k + 1) % 3], i});
    }
  return edges;
}

std::vector<std::vector<uint32_t>> ConnectedParts(const Surface& surface, std::span<const uint32_t> faces) {
  const Members members(faces);
  std::vector<uint32_t> parent(faces.size()), number(faces.size(), kNone);
  std::iota(parent.begin(), parent.end(), 0u);
  for (uint32_t i = 0; i < faces.size(); ++i)
    for (const uint32_t other : surface.across[faces[i]])
      if (const uint32_t j = other == kNone ? kNone : members.IndexOf(other); j != kNone) Join(parent, i, j);
  std::vector<std::vector<uint32_t>> parts;
  for (uint32_t i = 0; i < faces.size(); ++i) {
    uint32_t& part = number[Find(parent, i)];
    if (part == kNone) {
      part = static_cast<uint32_t>(parts.size());
      parts.emplace_back();
    }
    parts[part].push_back(faces[i]);
  }
  return parts;
}

bool IsFlipped(const FlatChart& chart, size_t face) {
  const auto& [a, b, c] = chart.corner[face];
  const Vec2d u = chart.uv[b] - chart.uv[a], v = chart.uv[c] - chart.uv[a];
  return !(Cross(u, v) > kFlatShare * (u.x * u.x + u.y * u.y + v.x * v.x + v.y * v.y));
}

double SignedArea2(const FlatChart& chart, size_t face) {
  const auto& [a, b, c] = chart.corner[face];
  return Cross(chart.uv[b] - chart.uv[a], chart.uv[c] - chart.uv[a]);
}

}  // namespace bakewell::chart
