#include "server/chart/pack/packer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "server/chart/keyed_random.h"

namespace bakewell::chart {
namespace {

std::vector<uint32_t> PlacingOrder(std::span<const Candidate> candidates, const Order& order) {
  std::vector<double> rank(candidates.size());
  for (uint32_t i = 0; i < rank.size(); ++i) {
    const Shape& shape = candidates[i].poses[0].shape;
    const double longest = std::max(shape.width, shape.height);
    rank[i] = (double(candidates[i].cells) + order.long_weight * longest * longest) *
              (1 + order.jitter * KeyedRandom(order.seed, i));
  }
  std::vector<uint32_t> sorted(candidates.size());
  std::iota(sorted.begin(), sorted.end(), 0u);
  std::stable_sort(sorted.begin(), sorted.end(), [&](uint32_t a, uint32_t b) { return rank[a] > rank[b]; });
  return sorted;
}

// Remembers how far down a page shapes of a size have been tried: the next of the same size begins a little above.
class SearchStart {
 public:
  int Of(const Shape& shape, int page) const {
    const auto it = row_.find(Key(shape, page));
    return it == row_.end() ? 0 : std::max(0, it->second - shape.height / 2);
  }
  void Set(const Shape& shape, int page, int row) { row_[Key(shape, page)] = row; }

 private:
  // Sizes are classed in steps of an eighth of an octave.
  static int ClassOf(int size) { return size <= 8 ? size : static_cast<int>(8 * std::log2(size)); }
  static std::array<int, 3> Key(const Shape& shape, int page) {
    return {page, ClassOf(shape.width), ClassOf(shape.height)};
  }
  std::map<std::array<int, 3>, int> row_;
};

class Packer {
 public:
  Packer(const Grid& grid, std::span<const Candidate> candidates) : grid_(grid), candidates_(candidates) {}

  Trial Run(const Order& order) && {
    trial_.placement.resize(candidates_.size());
    height_weight_ = order.height_weight;
    for (const uint32_t i : PlacingOrder(candidates_, order)) {
      if (Place(i)) continue;
      trial_.complete = false;
      break;
    }
    return std::move(trial_);
  }

 private:
  struct Choice {
    const Pose* pose = nullptr;
    Spot spot{0, 0};
  };

  bool Place(uint32_t i) {
    for (int page = 0; page < grid_.max_pages; ++page) {
      if (page == static_cast<int>(pages_.size())) {
        pages_.emplace_back(grid_.width, grid_.height);
        trial_.cells.push_back(0);
      }
      const Choice choice = Choose(candidates_[i], page);
      if (choice.pose == nullptr) continue;
      Commit(i, page, choice);
      return true;
    }
    return false;
  }

  Choice Choose(const Candidate& candidate, int page) {
    Choice best;
    double least = INFINITY;
    for (const Pose& pose : candidate.poses) {
      const int height = pose.shape.height, from = start_.Of(pose.shape, page);
      const double last_row = std::ceil(least - height_weight_ * height) - 1;
      const int limit = static_cast<int>(std::clamp(last_row + height, 0.0, double(grid_.height)));
      const auto spot = pages_[page].FindLowest(pose.shape, from, limit);
      start_.Set(pose.shape, page, spot ? spot->y : std::max(from, limit - height));
      if (!spot) continue;
      best = {&pose, *spot};
      least = spot->y + height_weight_ * height;
    }
    return best;
  }

  void Commit(uint32_t i, int page, const Choice& choice) {
    const Shape& shape = choice.pose->shape;
    pages_[page].Place(shape, choice.spot);
    Placement& placement = trial_.placement[i];
    placement = choice.pose->placement;
    placement.page = page;
    placement.corner = {double(choice.spot.x), double(choice.spot.y)};  // cells
    trial_.used_height = std::max(trial_.used_height, choice.spot.y + shape.height);
    trial_.used_width = std::max(trial_.used_width, choice.spot.x + shape.width);
    trial_.cells[page] += candidates_[i].cells;
  }

  Grid grid_;
  std::span<const Candidate> candidates_;
  std::vector<Page> pages_;
  SearchStart start_;
  double height_weight_ = 1;
  Trial trial_;
};

}  // namespace

Trial PlaceAll(const Grid& grid, std::span<const Candidate> candidates, const Order& order) {
  return Packer(grid, candidates).Run(order);
}

}  // namespace bakewell::chart
