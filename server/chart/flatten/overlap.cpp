#include "server/chart/flatten/overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace bakewell::chart {
namespace {

// Cross products below this share of the lengths involved are rounding: the points touch.
constexpr double kTouchShare = 1e-11;

// How far a border vertex is drawn in, as a share of the least altitude of its faces.
constexpr double kDrawIn = 1e-3;

struct Box {
  Vec2d low, high;
};

Box BoundsOf(std::span<const Vec2d> uv, const BoundaryEdge& e) {
  const Vec2d a = uv[e.a], b = uv[e.b];
  return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
}

// -1, 0 or 1: the side of the line a-b on which p lies; 0 also within rounding of it.
int SideOf(Vec2d a, Vec2d b, Vec2d p) {
  const Vec2d d = b - a, e = p - a;
  const double cross = Cross(d, e);
  const double limit =
      kTouchShare * (std::abs(d.x) + std::abs(d.y)) * (std::abs(d.x) + std::abs(d.y) + std::abs(e.x) + std::abs(e.y));
  return std::abs(cross) <= limit ? 0 : cross > 0 ? 1 : -1;
}

bool Cross(std::span<const Vec2d> uv, const BoundaryEdge& e, const BoundaryEdge& f) {
  if (e.a == f.a || e.a == f.b || e.b == f.a || e.b == f.b) return false;
  const Vec2d a = uv[e.a], b = uv[e.b], c = uv[f.a], d = uv[f.b];
  return SideOf(a, b, c) * SideOf(a, b, d) < 0 && SideOf(c, d, a) * SideOf(c, d, b) < 0;
}

// Horizontal bands of the bounding box; every band lists the edges that reach into it, by their left end.
class Bands {
 public:
  Bands(std::vector<Vec2d> points, std::span<const BoundaryEdge> edge) : uv_(std::move(points)), edge_(edge) {
    low_ = edge.empty() ? 0 : uv_[edge[0].a].y;
    double high = low_, length = 0;
    for (const auto& e : edge) {
      const Box box = BoundsOf(uv_, e);
      low_ = std::min(low_, box.low.y);
      high = std::max(high, box.high.y);
      length += box.high.y - box.low.y;
    }
    // Bands as high as an average edge, but no more of them than edges.
    const double mean = length / static_cast<double>(std::max<size_t>(edge.size(), 1));
    count_ = mean > 0 ? static_cast<int>(std::clamp((high - low_) / mean, 1.0, static_cast<double>(edge.size()))) : 1;
    height_ = (high - low_) / count_;
    Fill();
  }

  // The faces of edges that cross earlier ones.
  std::vector<uint32_t> CrossingFaces() const {
    std::vector<uint32_t> faces;
    for (size_t b = 0; b + 1 < begin_.size(); ++b)
      CollectCrossings(std::span(member_).subspan(begin_[b], begin_[b + 1] - begin_[b]), faces);
    return faces;
  }

 private:
  int BandOf(double y) const {
    return height_ > 0 ? static_cast<int>(std::clamp((y - low_) / height_, 0.0, count_ - 1.0)) : 0;
  }

  void Fill() {
    std::vector<uint32_t> order(edge_.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [this](uint32_t a, uint32_t b) {
      return BoundsOf(uv_, edge_[a]).low.x < BoundsOf(uv_, edge_[b]).low.x;
    });
    begin_.assign(static_cast<size_t>(count_) + 1, 0);
    for (const auto& e : edge_)
      for (int b = BandOf(BoundsOf(uv_, e).low.y); b <= BandOf(BoundsOf(uv_, e).high.y); ++b) ++begin_[b + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    member_.resize(begin_.back());
    std::vector<size_t> cursor(begin_.begin(), begin_.end() - 1);
    for (const uint32_t i : order)
      for (int b = BandOf(BoundsOf(uv_, edge_[i]).low.y); b <= BandOf(BoundsOf(uv_, edge_[i]).high.y); ++b)
        member_[cursor[b]++] = i;
  }

  // Sweeps a band from left to right; the active edges are those that have not ended yet.
  void CollectCrossings(std::span<const uint32_t> band, std::vector<uint32_t>& faces) const {
    std::vector<uint32_t> active;
    for (const uint32_t i : band) {
      const Box box = BoundsOf(uv_, edge_[i]);
      std::erase_if(active, [&](uint32_t j) { return BoundsOf(uv_, edge_[j]).high.x < box.low.x; });
      for (const uint32_t j : active)
        if (Cross(uv_, edge_[i], edge_[j])) faces.push_back(edge_[std::max(i, j)].face);
      active.push_back(i);
    }
  }

  std::vector<Vec2d> uv_;
  std::span<const BoundaryEdge> edge_;
  double low_ = 0, height_ = 0;
  int count_ = 1;
  std::vector<size_t> begin_;
  std::vector<uint32_t> member_;
};

double AngleAt(const FlatChart& chart, size_t face, int k) {
  const auto& corner = chart.corner[face];
  const Vec2d p = chart.uv[corner[k]];
  const Vec2d u = chart.uv[corner[(k + 1) % 3]] - p, v = chart.uv[corner[(k + 2) % 3]] - p;
  return std::atan2(u.x * v.y - u.y * v.x, u.x * v.x + u.y * v.y);
}

// The angle that a vertex' faces take in the plane, per vertex.
std::vector<double> AngleSums(const FlatChart& chart) {
  std::vector<double> sum(chart.vertex.size(), 0);
  for (size_t i = 0; i < chart.face.size(); ++i)
    for (int k = 0; k < 3; ++k) sum[chart.corner[i][k]] += AngleAt(chart, i, k);
  return sum;
}

// Full turns of each border loop, rounded; every vertex has at most one border edge that leaves it.
std::vector<int> LoopTurns(std::span<const BoundaryEdge> boundary, const std::vector<double>& angle) {
  std::vector<uint32_t> next(angle.size(), kNone);
  for (const BoundaryEdge& edge : boundary) next[edge.a] = edge.b;
  std::vector<int> turns;
  for (const BoundaryEdge& edge : boundary) {
    double turn = 0;
    uint32_t v = edge.a;
    while (next[v] != kNone) {
      turn += kPi - angle[v];
      v = std::exchange(next[v], kNone);
    }
    if (turn != 0) turns.push_back(static_cast<int>(std::lround(turn / (2 * kPi))));
  }
  return turns;
}

// Inner vertices must have faces all round once, border vertices not more than all round. Otherwise: an inner vertex
// gives up all its faces; a border vertex the face of the least angle there that is enough.
void CollectCrowdedVertices(const FlatChart& chart, std::span<const BoundaryEdge> boundary,
                            const std::vector<double>& angle, std::vector<uint32_t>& faces) {
  std::vector<bool> inner(angle.size(), true);
  for (const BoundaryEdge& edge : boundary) inner[edge.a] = false;
  std::vector<std::pair<double, uint32_t>> give_up(angle.size(), {INFINITY, kNone});
  for (uint32_t i = 0; i < chart.face.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const uint32_t v = chart.corner[i][k];
      const double excess = angle[v] - 2 * kPi;
      if (inner[v] && std::lround(excess / (2 * kPi)) != 0) faces.push_back(i);
      if (inner[v] || excess <= kTouchShare) continue;
      const double here = AngleAt(chart, i, k);
      give_up[v] = std::min(give_up[v], {here > excess ? here : here + 2 * kPi, i});
    }
  for (const auto& [unused, face] : give_up)
    if (face != kNone) faces.push_back(face);
}

// The least altitude of the faces around each vertex.
std::vector<double> LeastAltitudes(const FlatChart& chart) {
  std::vector<double> least(chart.vertex.size(), std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < chart.face.size(); ++i) {
    double longest = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec2d e = chart.uv[chart.corner[i][(k + 1) % 3]] - chart.uv[chart.corner[i][k]];
      longest = std::max(longest, std::hypot(e.x, e.y));
    }
    for (const uint32_t v : chart.corner[i]) least[v] = std::min(least[v], SignedArea2(chart, i) / longest);
  }
  return least;
}

// The border drawn in by a little: sides of a slit, which touch, part; sheets that lie exactly on one another cross.
std::vector<Vec2d> DrawnIn(const FlatChart& chart, std::span<const BoundaryEdge> boundary,
                           const std::vector<double>& angle) {
  const std::vector<double> altitude = LeastAltitudes(chart);
  std::vector<Vec2d> uv = chart.uv;
  for (const auto& [a, b, unused] : boundary) {
    const Vec2d d = chart.uv[b] - chart.uv[a];
    const double half = angle[a] / 2, c = std::cos(half), s = std::sin(half);
    const double step = kDrawIn * altitude[a] / std::hypot(d.x, d.y);
    uv[a] = chart.uv[a] + Vec2d{c * d.x - s * d.y, s * d.x + c * d.y} * step;
  }
  return uv;
}

}  // namespace

Conflicts FindConflicts(const Surface& surface, const FlatChart& chart) {
  Conflicts conflicts;
  for (uint32_t i = 0; i < chart.face.size(); ++i)
    if (IsFlipped(chart, i)) conflicts.face.push_back(i);
  if (!conflicts.face.empty()) return conflicts;
  const std::vector<BoundaryEdge> boundary = BoundaryEdges(surface, chart);
  const std::vector<double> angle = AngleSums(chart);
  CollectCrowdedVertices(chart, boundary, angle, conflicts.face);
  if (!conflicts.face.empty()) return conflicts;
  conflicts.face = Bands(DrawnIn(chart, boundary, angle), boundary).CrossingFaces();
  if (!conflicts.face.empty()) return conflicts;
  const std::vector<int> turns = LoopTurns(boundary, angle);
  const auto holes = std::count(turns.begin(), turns.end(), -1), outlines = std::count(turns.begin(), turns.end(), 1);
  conflicts.wrong_loops = outlines != 1 || holes + 1 != static_cast<std::ptrdiff_t>(turns.size());
  return conflicts;
}

}  // namespace bakewell::chart
