#include "worker/filter/seams.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "worker/filter/connect.h"
#include "worker/filter/connections.h"
#include "worker/sample/hash.h"

namespace bakewell {
namespace {

constexpr float kTouching = 1.5f;   // sides of the larger of two texels between their positions
constexpr float kSameSize = 2;      // of the sides of two texels
constexpr float kOffPlane = 0.35f;  // of the way between two texels: what it may rise over either's surface
constexpr float kApart = 0.05f;     // sides; nearer texels cover the same place
constexpr int kCellSides = 8;       // of a texel, those of a cell of the index
constexpr int kMostVisited = 2048;  // texels near one; where there are more, charts lie upon each other

struct Seams {
  std::array<Seam, kMostSeams> of;
  size_t count = 0;

  // Keeps the nearest of each chart, and the nearest charts; of equal ones those that came first.
  void Add(const TexelMap& map, const Seam& seam) {
    const int32_t chart = map.texels[seam.other].chart;
    size_t at = 0;
    while (at < count && map.texels[of[at].other].chart != chart) ++at;
    if (at == count && count < kMostSeams) {
      of[count++] = seam;
    } else {
      if (at == count) {
        const auto farther = [](const Seam& a, const Seam& b) { return a.distance < b.distance; };
        at = static_cast<size_t>(std::max_element(of.begin(), of.end(), farther) - of.begin());
      }
      if (seam.distance < of[at].distance) of[at] = seam;
    }
  }
};

float SideOf(const Texel& texel) { return std::sqrt(texel.area / std::max(texel.coverage, 1e-6f)); }

// A side that can be compared.
bool IsUsable(float side) { return side > 0 && std::isfinite(side); }

// The texels at charts' borders by where they are: cells of a size that goes with theirs.
class BorderIndex {
 public:
  // border: texels of usable sides.
  BorderIndex(const TexelMap& map, std::vector<uint32_t> border) : map_(map), border_(std::move(border)) {
    for (const uint32_t i : border_) {
      const Texel& texel = map_.texels[i];
      const int size = std::ilogb(SideOf(texel));
      sizes_.push_back(size);
      cells_[KeyOf(size, CellOf(texel.position, size))].push_back(i);
    }
    std::sort(sizes_.begin(), sizes_.end());
    sizes_.erase(std::unique(sizes_.begin(), sizes_.end()), sizes_.end());
  }

  const std::vector<uint32_t>& border() const { return border_; }

  // Texels that may lie within kTouching of `texel` and be of about its size, and others; kMostVisited at most.
  template <typename Visit>
  void VisitNear(const Texel& texel, Visit visit) const {
    const float side = SideOf(texel);
    const int of_texel = std::ilogb(side);
    int visited = 0;
    for (const int size : sizes_) {
      if (std::abs(size - of_texel) > 1) continue;
      const float reach = kTouching * std::max(side, std::ldexp(1.0f, size + 1));
      const Vec3f by{reach, reach, reach};
      const Cell low = CellOf(texel.position - by, size), high = CellOf(texel.position + by, size);
      for (int64_t x = low[0]; x <= high[0]; ++x) {
        for (int64_t y = low[1]; y <= high[1]; ++y) {
          for (int64_t z = low[2]; z <= high[2]; ++z) {
            const auto found = cells_.find(KeyOf(size, {x, y, z}));
            if (found == cells_.end()) continue;
            for (const uint32_t other : found->second) {
              if (++visited > kMostVisited) return;
              visit(other);
            }
          }
        }
      }
    }
  }

 private:
  // Of texels with sides of [2^size, 2^(size + 1)).
  using Cell = std::array<int64_t, 3>;
  static Cell CellOf(Vec3f position, int size) {
    const double scale = std::ldexp(1.0, -size) / kCellSides;
    const auto cell = [scale](float at) {
      return static_cast<int64_t>(std::clamp(std::floor(static_cast<double>(at) * scale), -0x1p60, 0x1p60));
    };
    return {cell(position.x), cell(position.y), cell(position.z)};
  }
  static uint64_t KeyOf(int size, const Cell& cell) {
    uint32_t low = static_cast<uint32_t>(size), high = ~low;
    for (const int64_t at : cell) {
      low = HashCombine(low, static_cast<uint32_t>(at));
      high = HashCombine(high, static_cast<uint32_t>(at));
    }
    return uint64_t{high} << 32 | low;
  }

  const TexelMap& map_;
  const std::vector<uint32_t> border_;
  std::vector<int> sizes_;
  std::unordered_map<uint64_t, std::vector<uint32_t>> cells_;
};

class SeamFinder {
 public:
  SeamFinder(const World& world, const TexelMap& map, int page, const std::vector<bool>& valid,
             std::span<const uint8_t> open)
      : world_(world), map_(map), page_(page), valid_(valid), open_(open), place_(map.texels.size(), -1) {}

  std::vector<Seam> Run(int64_t& rays) {
    const BorderIndex index(map_, Border());
    std::vector<uint32_t> ring = Match(index, rays);
    for (int step = 0; step < kSeamReach; ++step) ring = Spread(ring);
    std::vector<Seam> result;
    for (const int32_t place : place_) {
      if (place < 0) continue;
      const Seams& seams = seams_[static_cast<size_t>(place)];
      result.insert(result.end(), seams.of.begin(), seams.of.begin() + seams.count);
    }
    return result;
  }

 private:
  // -1 off the page and where there is no texel.
  int32_t Neighbour(const Texel& texel, size_t k) const {
    const PageSize page = map_.pages[page_];
    const int x = texel.x + kNeighbours[k][0], y = texel.y + kNeighbours[k][1];
    if (x < 0 || y < 0 || x >= page.width || y >= page.height) return -1;
    return map_.texel_at[page_][static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x)];
  }

  std::vector<uint32_t> Border() const {
    std::vector<uint32_t> border;
    for (uint32_t i = 0; i < map_.texels.size(); ++i) {
      const Texel& texel = map_.texels[i];
      if (texel.page != page_ || !valid_[i] || !IsUsable(SideOf(texel))) continue;
      for (size_t k = 0; k < kNeighbours.size(); ++k) {
        const int32_t other = Neighbour(texel, k);
        if (other >= 0 && map_.texels[other].chart == texel.chart) continue;
        border.push_back(i);
        break;
      }
    }
    return border;
  }

  // Returns the texels at a seam.
  std::vector<uint32_t> Match(const BorderIndex& index, int64_t& rays) {
    std::atomic<int64_t> all_rays{0};
    std::vector<Seams> open(index.border().size());
    tbb::parallel_for(size_t{0}, open.size(), [&](size_t i) {
      const uint32_t at = index.border()[i];
      const Texel& texel = map_.texels[at];
      Seams near;
      index.VisitNear(texel, [&](uint32_t other) {
        const float distance = Touching(texel, map_.texels[other]);
        if (distance > 0) near.Add(map_, {at, other, distance});
      });
      int64_t own_rays = 0;
      for (size_t k = 0; k < near.count; ++k) {
        const Seam& seam = near.of[k];
        if (LiesOpen(world_, texel, map_.texels[seam.other], seam.distance, own_rays)) open[i].Add(map_, seam);
      }
      all_rays += own_rays;
    });
    rays += all_rays;
    std::vector<uint32_t> matched;
    for (size_t i = 0; i < open.size(); ++i) {
      if (open[i].count == 0) continue;
      matched.push_back(index.border()[i]);
      At(index.border()[i]) = open[i];
    }
    return matched;
  }

  // Makes room where there is none.
  Seams& At(uint32_t texel) {
    if (place_[texel] < 0) {
      place_[texel] = static_cast<int32_t>(seams_.size());
      seams_.emplace_back();
    }
    return seams_[static_cast<size_t>(place_[texel])];
  }

  // In sides of a; 0 where b is not how a's surface goes on.
  static float Touching(const Texel& a, const Texel& b) {
    if (a.chart == b.chart || Dot(a.normal, b.normal) < kSameFacing) return 0;
    const float side_a = SideOf(a), side_b = SideOf(b), larger = std::max(side_a, side_b);
    const Vec3f way = b.position - a.position;
    const float length = Length(way);
    if (larger > kSameSize * std::min(side_a, side_b) || !(length < kTouching * larger) || length < kApart * larger) {
      return 0;
    }
    const float rise = std::max(std::abs(Dot(way, a.normal)), std::abs(Dot(way, b.normal)));
    return rise <= kOffPlane * length ? length / side_a : 0;
  }

  // To the neighbours that have no seams yet; returns these.
  std::vector<uint32_t> Spread(const std::vector<uint32_t>& ring) {
    std::vector<uint32_t> next;
    std::vector<Seam> found;
    for (const uint32_t from : ring) {
      const Seams known = At(from);
      for (size_t k = 0; k < kNeighbours.size(); ++k) {
        const int32_t at = Neighbour(map_.texels[from], k);
        if (at < 0 || place_[at] >= 0 || !AreConnected(from, static_cast<uint32_t>(at), k)) continue;
        const Texel& texel = map_.texels[at];
        const float side = SideOf(texel);
        for (size_t s = 0; IsUsable(side) && s < known.count; ++s) {
          const uint32_t other = known.of[s].other;
          const float distance = Length(map_.texels[other].position - texel.position) / side;
          found.push_back({static_cast<uint32_t>(at), other, distance});
        }
      }
    }
    for (const Seam& seam : found) {
      if (place_[seam.texel] < 0) next.push_back(seam.texel);
      At(seam.texel).Add(map_, seam);
    }
    return next;
  }

  bool AreConnected(uint32_t a, uint32_t b, size_t k) const {
    if (!valid_[a] || !valid_[b]) return false;
    return k < 4 ? (open_[a] >> k & 1) != 0 : (open_[b] >> (k - 4) & 1) != 0;
  }

  const World& world_;
  const TexelMap& map_;
  const int page_;
  const std::vector<bool>& valid_;
  const std::span<const uint8_t> open_;
  std::vector<int32_t> place_;  // one element a texel: in seams_, or -1
  std::vector<Seams> seams_;
};

}  // namespace

std::vector<Seam> FindSeams(const World& world, const TexelMap& map, int page, const std::vector<bool>& valid,
                            std::span<const uint8_t> open, int64_t& rays) {
  return SeamFinder(world, map, page, valid, open).Run(rays);
}

}  // namespace bakewell
