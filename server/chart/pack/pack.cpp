#include "server/chart/pack/pack.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include "core/base/check.h"
#include "server/chart/pack/density.h"
#include "server/chart/pack/packer.h"

namespace bakewell::chart {
namespace {

constexpr int kBlock = 4;
constexpr int kDefaultSide = 1024;
constexpr int kMaxSide = 8192;
constexpr int kMaxPages = 256;
constexpr int kMaxTrials = 40;
// Page widths that are tried where they are free: sqrt(texels) * 2^(kLeastWidth + i * kWidthStep).
constexpr int kFreeWidths = 12;
constexpr double kLeastWidth = -0.5, kWidthStep = 0.15;
// Side of the coarse pages on which plans are compared: a quarter of the page's, within bounds [cells].
constexpr double kSketchShare = 0.25, kLeastSketch = 48, kLargestSketch = 256;

// How hard to look.
struct Effort {
  int trials;         // densities
  int plans;          // orders and page shapes that are sketched, for few charts
  int semifinalists;  // of them, those that are packed at full size
  int finalists;      // of those, the ones that get a density search
  int tilts;
};
constexpr Effort kNormalEffort{5, 108, 8, 2, 3}, kBruteEffort{12, 432, 32, 4, 4};

struct Plan {
  Order order;
  double aspect = 1;  // page width / height
};

struct Outcome {
  Trial trial;
  Grid grid{0, 0, 1};
  Raster raster;
  // Density for the page area used; a page of a given shape counts whole.
  double Score(bool free_shape) const {
    const double area = double(grid.width) * (free_shape ? trial.used_height : grid.height);
    return raster.texels_per_unit / std::sqrt(area);
  }
};

std::vector<Candidate> MakeCandidates(std::span<const PackItem> items, const Raster& raster) {
  std::vector<Candidate> candidates(items.size());
  tbb::parallel_for(size_t{0}, items.size(), [&](size_t i) { candidates[i] = MakeCandidate(items[i], raster); });
  return candidates;
}

int RoundUp(int value, int step) { return (value + step - 1) / step * step; }

Grid GridOf(double texels, double aspect, int cell) {
  const double width = std::sqrt(texels * aspect);
  const int cells = std::max(1, static_cast<int>(std::lround(width / kBlock)) * kBlock / cell);
  return {cells, static_cast<int>(texels / (double(cells) * cell * cell)), 1};
}

// Orders by size, by length, and keyed variations of both; page shapes from square to 2 : 3 where they are free.
std::vector<Plan> MakePlans(int count, bool free_shape) {
  std::vector<Plan> plans;
  for (int i = 0; i < count; ++i) {
    Plan plan;
    plan.order.long_weight = i % 3 == 0 ? 0.25 : i % 3 == 1 ? 1.0 : 0.0;
    plan.order.height_weight = i / 3 % 2 == 0 ? 1.0 : 0.5;
    plan.order.jitter = i < 54 ? 0 : 0.35;
    plan.order.seed = static_cast<uint32_t>(i);
    if (free_shape) plan.aspect = std::exp2((i / 6 % 9 - 4) * 0.11);
    plans.push_back(plan);
  }
  return plans;
}

// Packs every plan at one density and sorts them by the page area they use.
std::vector<Plan> RankPlans(std::span<const Candidate> candidates, const std::vector<Plan>& plans, double page_texels,
                            int cell) {
  std::vector<double> area(plans.size());
  tbb::parallel_for(size_t{0}, plans.size(), [&](size_t i) {
    Grid grid = GridOf(page_texels, plans[i].aspect, cell);
    grid.height *= 3;
    const Trial trial = PlaceAll(grid, candidates, plans[i].order);
    area[i] = trial.complete ? double(trial.used_height) * grid.width : INFINITY;
  });
  std::vector<size_t> order(plans.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return area[a] < area[b]; });
  std::vector<Plan> ranked;
  for (const size_t i : order) ranked.push_back(plans[i]);
  return ranked;
}

// The best plans, first by coarse sketches without gutters, then by whole texels.
std::vector<Plan> BestPlans(std::span<const PackItem> items, std::vector<Plan> plans, Raster raster, double texels,
                            const Effort& effort) {
  raster.texels_per_unit =
      std::min(EstimateDensity(items, raster.gutter, 0.85 * texels), LargestUnclampedDensity(items, raster));
  Raster sketch = raster;
  const double side = std::clamp(kSketchShare * std::sqrt(texels), kLeastSketch, kLargestSketch);
  sketch.texels_per_unit *= side / std::sqrt(texels);
  sketch.cell = 1;
  sketch.gutter = 0;
  plans = RankPlans(MakeCandidates(items, sketch), plans, side * side, 1);
  plans.resize(std::min<size_t>(plans.size(), effort.semifinalists));
  plans = RankPlans(MakeCandidates(items, raster), plans, texels, raster.cell);
  plans.resize(std::min<size_t>(plans.size(), effort.finalists));
  return plans;
}

// The largest density that fits one page: a page twice as high tells by how much a trial misses.
std::optional<Outcome> SearchDensity(std::span<const PackItem> items, Raster raster, const Grid& page, const Plan& plan,
                                     int trials) {
  const Grid tall{page.width, 2 * page.height, 1};
  const double texels = double(page.width) * page.height * raster.cell * raster.cell;
  const double cap = LargestUnclampedDensity(items, raster);
  double low = 0, high = INFINITY, density = EstimateDensity(items, raster.gutter, 0.9 * texels);
  std::optional<Outcome> best;
  for (int i = 0; i < trials || (!best && i < kMaxTrials); ++i) {
    density = std::min(density, cap);
    raster.texels_per_unit = density;
    Trial trial = PlaceAll(tall, MakeCandidates(items, raster), plan.order);
    const double used = trial.complete ? trial.used_height : 2.0 * page.height;
    const bool fits = trial.complete && trial.used_height <= page.height;
    (fits ? low : high) = density;
    if (fits) best = Outcome{std::move(trial), page, raster};
    if (fits && density == cap) break;
    density *= std::sqrt(page.height / used) * (fits ? 1.001 : 0.999);
    if (density <= low || density >= high) density = low > 0 ? low + (high - low) * 0.5 : high * 0.7;
    if (high < low * 1.0005) break;
  }
  return best;
}

// Few charts: the order and the page's shape decide, so many are sketched. Many charts fill any page well.
std::optional<Outcome> SearchPlans(std::span<const PackItem> items, Raster raster, double texels, bool free_shape,
                                   const Effort& effort) {
  const int affordable = static_cast<int>(size_t(effort.plans) * 64 / std::max<size_t>(items.size(), 64));
  raster.tilts = affordable > 1 ? effort.tilts : 1;
  std::vector<Plan> plans = MakePlans(std::max(affordable, 1), free_shape && affordable > 1);
  if (plans.size() > 1) plans = BestPlans(items, std::move(plans), raster, texels, effort);
  std::optional<Outcome> best;
  for (const Plan& plan : plans) {
    auto outcome = SearchDensity(items, raster, GridOf(texels, plan.aspect, raster.cell), plan, effort.trials);
    if (outcome && (!best || outcome->Score(free_shape) > best->Score(free_shape))) best = std::move(outcome);
  }
  return best;
}

PackResult ToResult(Outcome outcome, int width, int height) {
  const int cell = outcome.raster.cell;
  PackResult result{width,
                    height,
                    static_cast<int>(outcome.trial.cells.size()),
                    outcome.raster.texels_per_unit,
                    std::move(outcome.trial.placement),
                    {}};
  for (Placement& placement : result.placement) placement.corner = placement.corner * double(cell);
  const double all = double(width) * height / (cell * cell);
  for (const int64_t cells : outcome.trial.cells) result.utilization.push_back(double(cells) / all);
  return result;
}

int MaxPages(std::span<const PackItem> items) { return static_cast<int>(std::min<size_t>(items.size(), kMaxPages)); }

absl::Status TooManyPages(const Raster& raster) {
  return absl::ResourceExhaustedError("the charts take more than " + std::to_string(kMaxPages) + " pages at " +
                                      std::to_string(raster.texels_per_unit) +
                                      " texels per unit: lower the density or raise the resolution");
}

// Given density and side: as many pages as it takes.
absl::StatusOr<PackResult> PackPages(std::span<const PackItem> items, const Raster& raster, int side) {
  const Grid grid{side / raster.cell, side / raster.cell, MaxPages(items)};
  Trial trial = PlaceAll(grid, MakeCandidates(items, raster), {});
  if (!trial.complete) return TooManyPages(raster);
  return ToResult({std::move(trial), grid, raster}, grid.width * raster.cell, grid.height * raster.cell);
}

// One page in a grid of this width, cut to what it uses (whole blocks); nothing where it does not fit.
std::optional<PackResult> PackWidth(std::span<const Candidate> candidates, const Raster& raster, int width, int side) {
  const Grid grid{width / raster.cell, side / raster.cell, 1};
  Trial trial = PlaceAll(grid, candidates, {});
  if (!trial.complete) return std::nullopt;
  const int used_width = RoundUp(trial.used_width * raster.cell, kBlock);
  const int used_height = RoundUp(trial.used_height * raster.cell, kBlock);
  return ToResult({std::move(trial), grid, raster}, used_width, used_height);
}

// Several equal pages `side` wide, no higher than it takes for that number of pages.
absl::StatusOr<PackResult> PackFewestPages(std::span<const PackItem> items, const Raster& raster, int side) {
  BAKEWELL_ASSIGN_OR_RETURN(PackResult best, PackPages(items, raster, side));
  const std::vector<Candidate> candidates = MakeCandidates(items, raster);
  int low = 0, high = side / kBlock;  // page heights in blocks: too low, enough
  while (high - low > std::max(1, side / kBlock / 64)) {
    const int middle = (low + high) / 2;
    const Grid grid{side / raster.cell, middle * kBlock / raster.cell, best.pages};
    Trial trial = PlaceAll(grid, candidates, {});
    (trial.complete ? high : low) = middle;
    if (trial.complete) best = ToResult({std::move(trial), grid, raster}, side, middle * kBlock);
  }
  return best;
}

// Given density, free side: the page of least area that holds all, or as few and small pages as it takes.
absl::StatusOr<PackResult> PackFreeSide(std::span<const PackItem> items, const Raster& raster, int side) {
  double demand = 0;
  for (const PackItem& item : items) demand += Demand(item, raster.texels_per_unit, raster.gutter);
  const std::vector<Candidate> candidates = MakeCandidates(items, raster);
  std::optional<PackResult> best;
  int last_width = 0;
  for (int i = 0; i < kFreeWidths; ++i) {
    const double width = std::sqrt(demand) * std::exp2(kLeastWidth + kWidthStep * i);
    const int rounded = RoundUp(static_cast<int>(std::min<double>(width, side)), kBlock);
    if (rounded > side || rounded == last_width) continue;
    last_width = rounded;
    std::optional<PackResult> page = PackWidth(candidates, raster, rounded, side);
    if (page && (!best || page->width * page->height < best->width * best->height)) best = std::move(page);
  }
  if (best) return *std::move(best);
  return PackFewestPages(items, raster, side);
}

int MaxSide(const PackOptions& options) {
  return options.maxResolution > 0 ? static_cast<int>(options.maxResolution) / kBlock * kBlock : kMaxSide;
}

Raster RasterFor(const PackOptions& options, int side) {
  Raster raster;
  raster.texels_per_unit = options.texelsPerUnit;
  raster.cell = options.blockAlign ? kBlock : 1;
  raster.gutter = std::max<int>(static_cast<int>(options.padding), options.bilinear ? 2 : 0);
  raster.turn = options.rotateCharts;
  raster.max_size = options.maxChartSize > 0 ? static_cast<int>(options.maxChartSize) : kMaxSide;
  // A chart as long as the page must still fit with its half gutter and its place in a block.
  const int room = side / kBlock * kBlock - (options.blockAlign ? 2 * kBlock + raster.gutter : 0);
  raster.max_size = std::min(raster.max_size, std::max(room, 1));
  return raster;
}

}  // namespace

absl::StatusOr<PackResult> Pack(std::span<const PackItem> items, const PackOptions& options) {
  BAKEWELL_CHECK(!items.empty());
  const bool free_side = options.resolution == 0;
  const int side = free_side ? kDefaultSide : static_cast<int>(options.resolution);
  if (options.texelsPerUnit > 0)
    return free_side ? PackFreeSide(items, RasterFor(options, MaxSide(options)), MaxSide(options))
                     : PackPages(items, RasterFor(options, side), side);

  const double texels = double(side) * side;
  Raster raster = RasterFor(options, side);
  std::optional<Outcome> best;
  const double least = Demand({}, 0, raster.gutter) * double(items.size());
  if (least < texels) best = SearchPlans(items, raster, texels, free_side, kNormalEffort);
  if (options.bruteForce && best) {
    auto other = SearchPlans(items, raster, texels, free_side, kBruteEffort);
    if (other && other->Score(free_side) > best->Score(free_side)) best = std::move(other);
  }
  if (!best) {
    // More charts than a page has room for, however small: as many pages as they need.
    raster.texels_per_unit = EstimateDensity(items, raster.gutter, 2 * std::max(texels, least));
    return PackPages(items, raster, side);
  }
  const int width = best->grid.width * raster.cell;
  const int height = free_side ? best->trial.used_height * raster.cell : best->grid.height * raster.cell;
  return ToResult(*std::move(best), width, RoundUp(height, kBlock));
}

}  // namespace bakewell::chart
