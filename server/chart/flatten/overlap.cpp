#include "server/chart/flatten/overlap.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace bakewell::chart {
namespace {

// Cross products below this share of the lengths involved are rounding: the points touch.
constexpr double kTouchShare = 1e-11;

struct Box {
  Vec2d low, high;
};

Box BoundsOf(std::span<const Vec2d> uv, const std::array<uint32_t, 2>& e) {
  const Vec2d a = uv[e[0]], b = uv[e[1]];
  return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
}

// -1, 0 or 1: the side of the line a-b on which p lies; 0 also within rounding of it.
int SideOf(Vec2d a, Vec2d b, Vec2d p) {
  const Vec2d d = b - a, e = p - a;
  const double cross = Cross(d, e);
  const double limit = kTouchShare * (std::abs(d.x) + std::abs(d.y)) *
                       (std::abs(d.x) + std::abs(d.y) + std::abs(e.x) + std::abs(e.y));
  return std::abs(cross) <= limit ? 0 : cross > 0 ? 1 : -1;
}

bool Cross(std::span<const Vec2d> uv, const std::array<uint32_t, 2>& e, const std::array<uint32_t, 2>& f) {
  if (e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1]) return false;
  const Vec2d a = uv[e[0]], b = uv[e[1]], c = uv[f[0]], d = uv[f[1]];
  return SideOf(a, b, c) * SideOf(a, b, d) < 0 && SideOf(c, d, a) * SideOf(c, d, b) < 0;
}

// Horizontal bands of the bounding box; every band lists the edges that reach into it, by their left end.
class Bands {
 public:
  Bands(std::span<const Vec2d> uv, std::span<const std::array<uint32_t, 2>> edge) : uv_(uv), edge_(edge) {
    low_ = edge.empty() ? 0 : uv[edge[0][0]].y;
    double high = low_, length = 0;
    for (const auto& e : edge) {
      const Box box = BoundsOf(uv, e);
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

  bool AnyCrossing() const {
    for (size_t b = 0; b + 1 < begin_.size(); ++b)
      if (CrossingIn(std::span(member_).subspan(begin_[b], begin_[b + 1] - begin_[b]))) return true;
    return false;
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
  bool CrossingIn(std::span<const uint32_t> band) const {
    std::vector<uint32_t> active;
    for (const uint32_t i : band) {
      const Box box = BoundsOf(uv_, edge_[i]);
      std::erase_if(active, [&](uint32_t j) { return BoundsOf(uv_, edge_[j]).high.x < box.low.x; });
      for (const uint32_t j : active)
        if (Cross(uv_, edge_[i], edge_[j])) return true;
      active.push_back(i);
    }
    return false;
  }

  std::span<const Vec2d> uv_;
  std::span<const std::array<uint32_t, 2>> edge_;
  double low_ = 0, height_ = 0;
  int count_ = 1;
  std::vector<size_t> begin_;
  std::vector<uint32_t> member_;
};

}  // namespace

bool OutlineCrossesItself(std::span<const Vec2d> uv, std::span<const std::array<uint32_t, 2>> edge) {
  return Bands(uv, edge).AnyCrossing();
}

}  // namespace bakewell::chart
