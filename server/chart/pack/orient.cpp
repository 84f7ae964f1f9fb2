#include "server/chart/pack/orient.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace bakewell::chart {
namespace {

// Of directions whose rectangles differ by less than this share the first is kept, whatever rounding says.
constexpr double kBetterShare = 1e-6;

// Andrew's monotone chain; counter-clockwise, no three points in line.
std::vector<Vec2d> ConvexHull(std::vector<Vec2d> points) {
  std::sort(points.begin(), points.end(), [](Vec2d a, Vec2d b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<Vec2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t base = hull.size();
    for (const Vec2d p : points) {
      while (hull.size() >= base + 2 && Cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

double Along(Vec2d p, Vec2d d) { return p.x * d.x + p.y * d.y; }

// Rotating calipers: the extremes in a direction and across it move on as the direction turns.
class Calipers {
 public:
  explicit Calipers(const std::vector<Vec2d>& hull) : hull_(hull) {}

  double Area(size_t edge, Vec2d direction) {
    const Vec2d across{-direction.y, direction.x};
    if (edge == 0) {
      far_ = Extreme(direction), high_ = Extreme(across), near_ = Extreme(direction * -1.0);
    }
    Advance(far_, direction);
    Advance(high_, across);
    Advance(near_, direction * -1.0);
    const double width = Along(hull_[far_] - hull_[near_], direction);
    return width * Along(hull_[high_] - hull_[edge], across);
  }

 private:
  size_t Extreme(Vec2d d) const {
    size_t best = 0;
    for (size_t i = 1; i < hull_.size(); ++i)
      if (Along(hull_[i], d) > Along(hull_[best], d)) best = i;
    return best;
  }
  void Advance(size_t& i, Vec2d d) const {
    for (size_t n = 0; n < hull_.size(); ++n) {
      const size_t next = (i + 1) % hull_.size();
      if (Along(hull_[next], d) < Along(hull_[i], d)) return;
      i = next;
    }
  }

  const std::vector<Vec2d>& hull_;
  size_t far_ = 0, high_ = 0, near_ = 0;
};

}  // namespace

Vec2d LeastRectangleAxis(std::span<const Segment2> outline) {
  std::vector<Vec2d> points;
  points.reserve(2 * outline.size());
  for (const Segment2& segment : outline) points.insert(points.end(), segment.begin(), segment.end());
  const std::vector<Vec2d> hull = ConvexHull(std::move(points));
  if (hull.size() < 2) return {1, 0};
  Calipers calipers(hull);
  Vec2d best{1, 0};
  double least = INFINITY;
  for (size_t i = 0; i < hull.size(); ++i) {
    const Vec2d edge = hull[(i + 1) % hull.size()] - hull[i];
    const double length = std::hypot(edge.x, edge.y);
    if (!(length > 0)) continue;
    const Vec2d direction = edge * (1 / length);
    const double area = hull.size() == 2 ? 0 : calipers.Area(i, direction);
    if (area >= least * (1 - kBetterShare)) continue;
    least = area;
    best = direction;
  }
  return best;
}

Vec2d SizeAlong(std::span<const Segment2> outline, Vec2d axis) {
  Vec2d low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const Segment2& segment : outline)
    for (const Vec2d p : segment) {
      const Vec2d q{Along(p, axis), Cross(axis, p)};
      low = {std::min(low.x, q.x), std::min(low.y, q.y)};
      high = {std::max(high.x, q.x), std::max(high.y, q.y)};
    }
  return outline.empty() ? Vec2d{0, 0} : high - low;
}

}  // namespace bakewell::chart
