#include "server/chart/flatten/split.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <tuple>

#include "server/chart/keyed_random.h"

namespace bakewell::chart {
namespace {

// How much farther a turn by a right angle is than going straight on.
constexpr double kTurnPenalty = 8;

Vec3d Centroid(const Surface& surface, uint32_t f) {
  const auto& [a, b, c] = surface.face[f];
  return (surface.position[a] + surface.position[b] + surface.position[c]) / 3.0;
}

// Faces by place in a sorted list: a chart is small beside its surface.
class Members {
 public:
  explicit Members(std::span<const uint32_t> faces) : sorted_(faces.begin(), faces.end()) {
    std::sort(sorted_.begin(), sorted_.end());
  }
  size_t size() const { return sorted_.size(); }
  uint32_t operator[](size_t i) const { return sorted_[i]; }
  uint32_t IndexOf(uint32_t face) const {
    if (face == kNone) return kNone;
    const auto it = std::lower_bound(sorted_.begin(), sorted_.end(), face);
    return it != sorted_.end() && *it == face ? static_cast<uint32_t>(it - sorted_.begin()) : kNone;
  }

 private:
  std::vector<uint32_t> sorted_;
};

struct Growth {
  std::vector<double> distance;
  std::vector<uint32_t> owner;  // which seed, kNone where no seed reaches
  uint32_t last = 0;            // the reached face that is farthest
};

// Dijkstra over the dual graph from several seeds at once.
Growth Grow(const Surface& surface, const Members& members, std::span<const uint32_t> seeds) {
  using Entry = std::tuple<double, uint32_t, uint32_t>;  // distance, face, seed
  Growth growth{std::vector<double>(members.size(), std::numeric_limits<double>::infinity()),
                std::vector<uint32_t>(members.size(), kNone)};
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (uint32_t s = 0; s < seeds.size(); ++s) queue.emplace(0.0, seeds[s], s);
  while (!queue.empty()) {
    const auto [distance, i, seed] = queue.top();
    queue.pop();
    if (growth.owner[i] != kNone) continue;
    growth.owner[i] = seed;
    growth.distance[i] = distance;
    growth.last = i;
    for (const uint32_t other : surface.across[members[i]]) {
      const uint32_t j = members.IndexOf(other);
      if (j == kNone || growth.owner[j] != kNone) continue;
      const double turn = 1 - Dot(surface.normal[members[i]], surface.normal[other]);
      const double step =
          UntiedStep(Length(Centroid(surface, members[i]) - Centroid(surface, other)), members[i], other);
      queue.emplace(distance + step * (1 + kTurnPenalty * turn), j, seed);
    }
  }
  return growth;
}

}  // namespace

std::vector<std::vector<uint32_t>> SplitInTwo(const Surface& surface, std::span<const uint32_t> faces) {
  const Members members(faces);
  const uint32_t first = 0;
  const uint32_t one = Grow(surface, members, std::span(&first, 1)).last;
  const uint32_t two = Grow(surface, members, std::span(&one, 1)).last;
  const std::array<uint32_t, 2> seeds{one, two};
  const Growth growth = Grow(surface, members, seeds);
  std::vector<std::vector<uint32_t>> parts(2);
  for (size_t i = 0; i < members.size(); ++i)
    parts[growth.owner[i] == kNone ? 0 : growth.owner[i]].push_back(members[i]);
  std::erase_if(parts, [](const auto& part) { return part.empty(); });
  return parts;
}

}  // namespace bakewell::chart
