#include "server/chart/rounding.h"

#include <algorithm>
#include <cmath>

namespace bakewell::chart {
namespace {

constexpr int kReach = 4;   // units in the last place that a vertex may move
constexpr int kRounds = 4;  // a repair may uncover a neighbour

class Repair {
 public:
  Repair(std::span<const std::array<uint32_t, 3>> corner, std::vector<TexelUv>& uv, Vec2d page)
      : corner_(corner), uv_(uv), page_(page) {}

  void Run() {
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<uint32_t> flipped = Flipped();
      if (flipped.empty()) return;
      if (faces_of_.empty()) ListFaces();
      for (const uint32_t f : flipped)
        if (IsFlipped(f)) Unflip(f);
    }
  }

 private:
  // Exact: differences of floats on a page and their products fit a double.
  bool IsFlipped(uint32_t f) const {
    const TexelUv a = uv_[corner_[f][0]], b = uv_[corner_[f][1]], c = uv_[corner_[f][2]];
    return (double(b.x) - a.x) * (double(c.y) - a.y) < (double(b.y) - a.y) * (double(c.x) - a.x);
  }

  std::vector<uint32_t> Flipped() const {
    std::vector<uint32_t> flipped;
    for (uint32_t f = 0; f < corner_.size(); ++f)
      if (IsFlipped(f)) flipped.push_back(f);
    return flipped;
  }

  void ListFaces() {
    faces_of_.resize(uv_.size());
    for (uint32_t f = 0; f < corner_.size(); ++f)
      for (const uint32_t v : corner_[f]) faces_of_[v].push_back(f);
  }

  long FlipsAround(uint32_t v) const {
    return std::count_if(faces_of_[v].begin(), faces_of_[v].end(), [this](uint32_t f) { return IsFlipped(f); });
  }

  static float Step(float value, int ulps, double limit) {
    for (int i = 0; i < std::abs(ulps); ++i) value = std::nextafter(value, ulps > 0 ? 1e9f : -1e9f);
    return std::clamp(value, 0.0f, static_cast<float>(limit));
  }

  // The nearest move of any corner that leaves the fewest flips around it.
  void Unflip(uint32_t f) {
    for (const uint32_t v : corner_[f]) {
      const TexelUv home = uv_[v];
      TexelUv best = home;
      long least = FlipsAround(v);
      for (int reach = 1; reach <= kReach && least > 0; ++reach)
        for (int dy = -reach; dy <= reach; ++dy)
          for (int dx = -reach; dx <= reach; ++dx) {
            uv_[v] = {Step(home.x, dx, page_.x), Step(home.y, dy, page_.y)};
            if (const long flips = FlipsAround(v); flips < least) least = flips, best = uv_[v];
          }
      uv_[v] = best;
      if (!IsFlipped(f)) return;
    }
  }

  std::span<const std::array<uint32_t, 3>> corner_;
  std::vector<TexelUv>& uv_;
  Vec2d page_;
  std::vector<std::vector<uint32_t>> faces_of_;
};

}  // namespace

std::vector<TexelUv> RoundToFloat(std::span<const std::array<uint32_t, 3>> corner, std::span<const Vec2d> position,
                                  Vec2d page) {
  std::vector<TexelUv> uv;
  uv.reserve(position.size());
  for (const Vec2d p : position)
    uv.push_back({static_cast<float>(std::clamp(p.x, 0.0, page.x)), static_cast<float>(std::clamp(p.y, 0.0, page.y))});
  Repair(corner, uv, page).Run();
  return uv;
}

}  // namespace bakewell::chart
