#include "server/chart/pack/pack.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/base/check.h"

namespace bakewell::chart {
namespace {

constexpr int kBlock = 4;
constexpr int kDefaultSide = 1024;
constexpr int kTrials = 6, kBruteForceTrials = 24, kMaxTrials = 40;
constexpr int kMaxSide = 32768;

// Page limits in cells.
struct Grid {
  int width, height, cell;
  int max_pages;
};

std::vector<Candidate> MakeCandidates(std::span<const PackItem> items, const Raster& raster) {
  std::vector<Candidate> candidates(items.size());
  tbb::parallel_for(size_t{0}, items.size(), [&](size_t i) { candidates[i] = MakeCandidate(items[i], raster); });
  return candidates;
}

// Large and long charts first; ties by number.
std::vector<uint32_t> PlacingOrder(const std::vector<Candidate>& candidates) {
  std::vector<uint32_t> order(candidates.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto rank = [&](uint32_t i) {
    const Shape& shape = candidates[i].turns[0];
    return candidates[i].cells + int64_t{std::max(shape.width, shape.height)} * std::max(shape.width, shape.height) / 4;
  };
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return rank(a) > rank(b); });
  return order;
}

// Remembers how far down a page shapes of a size have been tried: the next of the same size begins there.
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

// One attempt to place everything.
struct Trial {
  bool complete = true;
  int used_height = 0;  // cells, of the fullest page
  int used_width = 0;
  int pages = 1;
  std::vector<Placement> placement;
  std::vector<int64_t> cells;  // per page
};

class Packer {
 public:
  Packer(const Grid& grid, const std::vector<Candidate>& candidates) : grid_(grid), candidates_(candidates) {}

  Trial Run() && {
    trial_.placement.resize(candidates_.size());
    for (const uint32_t i : PlacingOrder(candidates_)) {
      if (Place(i)) continue;
      trial_.complete = false;
      break;
    }
    trial_.pages = static_cast<int>(pages_.size());
    return std::move(trial_);
  }

 private:
  struct Choice {
    int turn = -1;
    Spot spot{0, 0};
    int top = 0;
  };

  bool Place(uint32_t i) {
    for (int page = 0; page < grid_.max_pages; ++page) {
      if (page == static_cast<int>(pages_.size())) {
        pages_.emplace_back(grid_.width, grid_.height);
        trial_.cells.push_back(0);
      }
      const Choice choice = Choose(candidates_[i], page);
      if (choice.turn < 0) continue;
      Commit(i, page, choice);
      return true;
    }
    return false;
  }

  // The turn that reaches least far down.
  Choice Choose(const Candidate& candidate, int page) {
    Choice best;
    int limit = grid_.height;
    for (int turn = 0; turn < static_cast<int>(candidate.turns.size()); ++turn) {
      const Shape& shape = candidate.turns[turn];
      const auto spot = pages_[page].FindLowest(shape, start_.Of(shape, page), limit);
      start_.Set(shape, page, spot ? spot->y : std::max(start_.Of(shape, page), limit - shape.height));
      if (!spot) continue;
      best = {turn, *spot, spot->y + shape.height};
      limit = best.top - 1;
    }
    return best;
  }

  void Commit(uint32_t i, int page, const Choice& choice) {
    const Shape& shape = candidates_[i].turns[choice.turn];
    pages_[page].Place(shape, choice.spot);
    Placement& placement = trial_.placement[i];
    placement = candidates_[i].placement;
    placement.page = page;
    placement.quarters = choice.turn;
    placement.corner = {double(choice.spot.x * grid_.cell), double(choice.spot.y * grid_.cell)};
    trial_.used_height = std::max(trial_.used_height, choice.top);
    trial_.used_width = std::max(trial_.used_width, choice.spot.x + shape.width);
    trial_.cells[page] += candidates_[i].cells;
  }

  Grid grid_;
  const std::vector<Candidate>& candidates_;
  std::vector<Page> pages_;
  SearchStart start_;
  Trial trial_;
};

struct Outcome {
  Trial trial;
  Raster raster;
  bool found = false;
};

Trial Attempt(std::span<const PackItem> items, const Raster& raster, const Grid& grid) {
  return Packer(grid, MakeCandidates(items, raster)).Run();
}

// Texels that an item takes at a density, with half its gutter.
double Demand(const PackItem& item, double density, double gutter) {
  const double scale = density * item.density;
  return item.area * scale * scale + (item.size.x + item.size.y) * scale * (1 + gutter) + (1 + gutter) * (1 + gutter);
}

// The density at which the items' demand is `texels`, by bisection on its logarithm.
double EstimateDensity(std::span<const PackItem> items, double gutter, double texels) {
  double area = 0;
  for (const PackItem& item : items) area += item.area * item.density * item.density;
  double high = std::log(std::sqrt(texels / area)), low = high - 20;
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2, density = std::exp(middle);
    double demand = 0;
    for (const PackItem& item : items) demand += Demand(item, density, gutter);
    (demand > texels ? high : low) = middle;
  }
  return std::exp(low);
}

// Above it some chart would be longer than the page.
double LargestUnclampedDensity(std::span<const PackItem> items, const Raster& raster) {
  double longest = 0;
  for (const PackItem& item : items) longest = std::max(longest, std::max(item.size.x, item.size.y) * item.density);
  return (raster.max_size - 0.5) / longest;
}

Grid GridFor(int side_x, int side_y, int cell) { return {side_x / cell, side_y / cell, cell, 1}; }

// The largest density that fits one page of the grid: a page twice as high tells by how much a trial misses.
Outcome SearchDensity(std::span<const PackItem> items, Raster raster, const Grid& page, int trials) {
  Grid tall = page;
  tall.height = 2 * page.height;
  const double texels = double(page.width) * page.cell * page.height * page.cell;
  double low = 0, high = INFINITY, density = EstimateDensity(items, raster.gutter, 0.9 * texels);
  const double cap = LargestUnclampedDensity(items, raster);
  Outcome best;
  for (int i = 0; i < trials || (!best.found && i < kMaxTrials); ++i) {
    density = std::min(density, cap);
    raster.texels_per_unit = density;
    Trial trial = Attempt(items, raster, tall);
    const double used = trial.complete ? trial.used_height : 2.0 * page.height;
    const bool fits = trial.complete && trial.used_height <= page.height;
    (fits ? low : high) = density;
    if (fits) best = {std::move(trial), raster, true};
    if (fits && density == cap) break;
    density *= std::sqrt(page.height / used) * (fits ? 1.001 : 0.999);
    if (density <= low || density >= high) density = low > 0 ? low + (high - low) * 0.5 : high * 0.7;
    if (high < low * 1.0005) break;
  }
  return best;
}

int RoundUp(int value, int step) { return (value + step - 1) / step * step; }

PackResult ToResult(Outcome outcome, int width, int height) {
  PackResult result{width, height, outcome.trial.pages, outcome.raster.texels_per_unit,
                    std::move(outcome.trial.placement), {}};
  const double all = double(width) * height / (outcome.raster.cell * outcome.raster.cell);
  for (const int64_t cells : outcome.trial.cells) result.utilization.push_back(double(cells) / all);
  return result;
}

// Given density: pages of the given side, or one page as large as need be.
PackResult PackAtDensity(std::span<const PackItem> items, const PackOptions& options, Raster raster) {
  raster.texels_per_unit = options.texelsPerUnit;
  if (options.resolution > 0) {
    Grid grid = GridFor(options.resolution, options.resolution, raster.cell);
    grid.max_pages = static_cast<int>(items.size());
    Trial trial = Attempt(items, raster, grid);
    return ToResult({std::move(trial), raster, true}, grid.width * grid.cell, grid.height * grid.cell);
  }
  double demand = 0, longest = 1;
  for (const PackItem& item : items) {
    demand += Demand(item, options.texelsPerUnit, raster.gutter);
    longest = std::max(longest, std::max(item.size.x, item.size.y) * options.texelsPerUnit * item.density + 2 * kBlock);
  }
  const int side = std::min(RoundUp(static_cast<int>(std::max(std::sqrt(demand * 1.2), longest)), kBlock), kMaxSide);
  Grid grid = GridFor(side, 2 * side, raster.cell);
  grid.max_pages = static_cast<int>(items.size());
  Trial trial = Attempt(items, raster, grid);
  const int width = RoundUp(trial.used_width * raster.cell, kBlock);
  const int height = RoundUp(trial.used_height * raster.cell, kBlock);
  return ToResult({std::move(trial), raster, true}, width, height);
}

}  // namespace

PackResult Pack(std::span<const PackItem> items, const PackOptions& options) {
  BAKEWELL_CHECK(!items.empty());
  const int side = options.resolution > 0 ? static_cast<int>(options.resolution) : kDefaultSide;
  Raster raster;
  raster.cell = options.blockAlign ? kBlock : 1;
  raster.gutter = std::max<int>(static_cast<int>(options.padding), options.bilinear ? 2 : 0);
  raster.turn = options.rotateCharts;
  raster.max_size = options.maxChartSize > 0 ? static_cast<int>(options.maxChartSize) : kMaxSide;
  const bool unlimited = options.resolution == 0 && options.texelsPerUnit > 0;
  if (!unlimited) raster.max_size = std::min(raster.max_size, side / kBlock * kBlock - (raster.cell > 1 ? 2 * kBlock : 0));
  if (options.texelsPerUnit > 0) return PackAtDensity(items, options, raster);
  const Grid grid = GridFor(side, side, raster.cell);
  Outcome best = SearchDensity(items, raster, grid, options.bruteForce ? kBruteForceTrials : kTrials);
  if (best.found) return ToResult(std::move(best), grid.width * grid.cell, grid.height * grid.cell);
  // More charts than a page has room for, however small: as many pages as they need.
  const double texels = double(side) * side;
  PackOptions pages = options;
  pages.resolution = static_cast<uint32_t>(side);
  pages.texelsPerUnit = static_cast<float>(
      EstimateDensity(items, raster.gutter, 2 * std::max(texels, Demand({}, 0, raster.gutter) * double(items.size()))));
  return PackAtDensity(items, pages, raster);
}

}  // namespace bakewell::chart
