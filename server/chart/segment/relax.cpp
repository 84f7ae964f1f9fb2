#include "server/chart/segment/relax.h"

#include <algorithm>
#include <array>
#include <limits>
#include <queue>
#include <tuple>

#include "server/chart/keyed_random.h"

namespace bakewell::chart {
namespace {

constexpr double kTurnPenalty = 8;       // per 1 - cos of an edge's angle
constexpr double kDeviationPenalty = 2;  // per 1 - cos of the angle to the chart's mean normal
constexpr double kSharp = 0.134;         // 1 - cos(30 degrees)
constexpr int kToothPasses = 4;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Entry {
  double distance;
  uint32_t face, label;
  bool operator>(const Entry& o) const {
    return std::tie(distance, face, label) > std::tie(o.distance, o.face, o.label);
  }
};
using Queue = std::priority_queue<Entry, std::vector<Entry>, std::greater<>>;

class Relaxation {
 public:
  Relaxation(const Surface& surface, const std::vector<uint32_t>& label)
      : surface_(surface), label_(label), centroid_(surface.FaceCount()) {
    uint32_t charts = 0;
    for (const uint32_t l : label) charts = std::max(charts, l + 1);
    mean_.resize(charts);
    for (uint32_t f = 0; f < label.size(); ++f) {
      const auto& [a, b, c] = surface.face[f];
      centroid_[f] = (surface.position[a] + surface.position[b] + surface.position[c]) / 3.0;
      mean_[label[f]] += surface.normal[f] * surface.area[f];
    }
    for (Vec3d& mean : mean_) mean = NormalizeOrZero(mean);
    movable_.resize(charts, false);
    for (uint32_t f = 0; f < label.size(); ++f)
      for (const uint32_t g : surface.across[f])
        if (g != kNone && label[g] != label[f] && Turn(f, g) <= kSharp) movable_[label[f]] = true;
  }

  std::vector<uint32_t> Run() const { return Grow(InnermostFaces()); }

 private:
  double Turn(uint32_t f, uint32_t g) const { return 1 - Dot(surface_.normal[f], surface_.normal[g]); }

  double Step(uint32_t f, uint32_t g) const { return UntiedStep(Length(centroid_[g] - centroid_[f]), f, g); }

  bool OnBorder(uint32_t f) const {
    for (const uint32_t g : surface_.across[f])
      if (g == kNone || label_[g] != label_[f]) return true;
    return false;
  }

  // Per chart the face that is farthest from the chart's border.
  std::vector<uint32_t> InnermostFaces() const {
    std::vector<double> depth(label_.size(), kInfinity);
    std::vector<uint32_t> innermost(mean_.size(), kNone);
    Queue queue;
    for (uint32_t f = 0; f < label_.size(); ++f)
      if (movable_[label_[f]] && OnBorder(f)) queue.push({0, f, label_[f]});
    while (!queue.empty()) {
      const Entry e = queue.top();
      queue.pop();
      if (depth[e.face] != kInfinity) continue;
      depth[e.face] = e.distance;
      innermost[e.label] = e.face;
      for (const uint32_t g : surface_.across[e.face])
        if (g != kNone && label_[g] == e.label && depth[g] == kInfinity)
          queue.push({e.distance + Step(e.face, g), g, e.label});
    }
    return innermost;
  }

  std::vector<uint32_t> Grow(const std::vector<uint32_t>& seeds) const {
    std::vector<uint32_t> grown(label_.size(), kNone);
    Queue queue;
    for (uint32_t l = 0; l < seeds.size(); ++l)
      if (seeds[l] != kNone) queue.push({0, seeds[l], l});
    while (!queue.empty()) {
      const Entry e = queue.top();
      queue.pop();
      if (grown[e.face] != kNone) continue;
      grown[e.face] = e.label;
      for (const uint32_t g : surface_.across[e.face]) {
        if (g == kNone || grown[g] != kNone) continue;
        const double turn = Turn(e.face, g);
        if (label_[g] != label_[e.face] && turn > kSharp) continue;
        const double deviation = 1 - Dot(surface_.normal[g], mean_[e.label]);
        queue.push(
            {e.distance + Step(e.face, g) * (1 + kTurnPenalty * turn + kDeviationPenalty * deviation), g, e.label});
      }
    }
    for (uint32_t f = 0; f < label_.size(); ++f)
      if (grown[f] == kNone) grown[f] = label_[f];  // of a chart that has no border to move
    return grown;
  }

  const Surface& surface_;
  const std::vector<uint32_t>& label_;
  std::vector<Vec3d> centroid_, mean_;
  std::vector<bool> movable_;  // per chart: some of its border is not sharp
};

}  // namespace

std::vector<uint32_t> RelaxOnce(const Surface& surface, const std::vector<uint32_t>& label) {
  return Relaxation(surface, label).Run();
}

void CutTeeth(const Surface& surface, std::vector<uint32_t>& label) {
  for (int pass = 0; pass < kToothPasses; ++pass)
    for (uint32_t f = 0; f < label.size(); ++f) {
      const auto& [a, b, c] = surface.across[f];
      for (const auto& [g, h, own] : {std::array{a, b, c}, std::array{b, c, a}, std::array{c, a, b}}) {
        if (g == kNone || h == kNone || own == kNone) continue;
        if (label[g] != label[h] || label[g] == label[f] || label[own] != label[f]) continue;
        if (std::max(1 - Dot(surface.normal[f], surface.normal[g]), 1 - Dot(surface.normal[f], surface.normal[h])) >
            kSharp)
          continue;
        label[f] = label[g];
      }
    }
}

}  // namespace bakewell::chart
