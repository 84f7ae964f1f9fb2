#include "server/chart/mesh/pairing.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace bakewell::chart {
namespace {

constexpr uint32_t kMaxCornersPerVertex = 256;
constexpr size_t kMaxExactPairing = 32;  // edges of more triangles are paired in input order

struct HalfEdge {
  uint32_t low, high, layer;
  uint32_t corner;  // 3 * face + k: from corner k to corner k+1
  bool forward;     // runs from low to high
};

uint32_t Next(uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

class UnionFind {
 public:
  explicit UnionFind(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  uint32_t Find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // The smaller root stays: the result does not depend on the order of joins.
  void Join(uint32_t a, uint32_t b) {
    a = Find(a), b = Find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parent_;
};

std::vector<HalfEdge> SortedHalfEdges(std::span<const std::array<uint32_t, 3>> triangle,
                                      std::span<const uint32_t> layer) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangle.size());
  for (uint32_t f = 0; f < triangle.size(); ++f)
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t a = triangle[f][k], b = triangle[f][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), layer[f], 3 * f + k, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.layer, a.corner) < std::tie(b.low, b.high, b.layer, b.corner);
  });
  return edges;
}

void JoinEdge(UnionFind& corners, const HalfEdge& a, const HalfEdge& b) {
  corners.Join(a.corner, Next(b.corner));
  corners.Join(Next(a.corner), b.corner);
}

// Angles whose cosines differ by less are equally flat, whatever rounding says. A power of two and a whole number of
// steps from each of 0, 1/2 and 1, so that the angles of regular meshes do not lie where rounding to steps turns over.
constexpr double kFlatnessStep = 0x1p-12;

struct Candidate {
  double flatness;  // in whole steps
  uint32_t a, b;
};

// All opposite pairs of one edge, the flattest first.
std::vector<Candidate> OppositePairs(std::span<const HalfEdge> group, std::span<const Vec3d> normal) {
  std::vector<Candidate> pairs;
  for (uint32_t i = 0; i < group.size(); ++i)
    for (uint32_t j = i + 1; j < group.size(); ++j)
      if (group[i].forward != group[j].forward)
        pairs.push_back(
            {std::round(Dot(normal[group[i].corner / 3], normal[group[j].corner / 3]) / kFlatnessStep), i, j});
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Candidate& x, const Candidate& y) { return x.flatness > y.flatness; });
  return pairs;
}

void JoinGroup(UnionFind& corners, std::span<const HalfEdge> group, std::span<const Vec3d> normal) {
  if (group.size() == 2 && group[0].forward != group[1].forward) return JoinEdge(corners, group[0], group[1]);
  if (group.size() < 3 || group.size() > kMaxExactPairing) return;
  std::vector<bool> taken(group.size(), false);
  for (const Candidate& pair : OppositePairs(group, normal)) {
    if (taken[pair.a] || taken[pair.b]) continue;
    taken[pair.a] = taken[pair.b] = true;
    JoinEdge(corners, group[pair.a], group[pair.b]);
  }
}

// Numbers the vertices in the order of their first corner, a new number after every kMaxCornersPerVertex corners.
std::vector<std::array<uint32_t, 3>> NumberVertices(UnionFind& corners, size_t faces) {
  std::vector<uint32_t> used(3 * faces, 0), number(3 * faces, 0);
  std::vector<std::array<uint32_t, 3>> result(faces);
  uint32_t next = 0;
  for (uint32_t c = 0; c < 3 * faces; ++c) {
    const uint32_t root = corners.Find(c);
    if (used[root]++ % kMaxCornersPerVertex == 0) number[root] = next++;
    result[c / 3][c % 3] = number[root];
  }
  return result;
}

}  // namespace

std::vector<std::array<uint32_t, 3>> SplitNonManifold(std::span<const std::array<uint32_t, 3>> triangle,
                                                      std::span<const uint32_t> layer, std::span<const Vec3d> normal) {
  const std::vector<HalfEdge> edges = SortedHalfEdges(triangle, layer);
  UnionFind corners(3 * triangle.size());
  for (size_t i = 0; i < edges.size();) {
    size_t j = i + 1;
    while (j < edges.size() && std::tie(edges[i].low, edges[i].high, edges[i].layer) ==
                                   std::tie(edges[j].low, edges[j].high, edges[j].layer))
      ++j;
    JoinGroup(corners, std::span(edges).subspan(i, j - i), normal);
    i = j;
  }
  return NumberVertices(corners, triangle.size());
}

}  // namespace bakewell::chart
