#include "server/chart/pack/item.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bakewell::chart {
namespace {

// How far a rectangle's side may be scaled so that both its ends lie on texel borders: with it densities stay within
// 1 % of one another.
constexpr double kSnapShare = 0.0045;

Vec2d Tilted(Vec2d axis, Vec2d p) { return {p.x * axis.x + p.y * axis.y, p.y * axis.x - p.x * axis.y}; }

// Texels before the turn.
Vec2d Scaled(const Placement& placement, Vec2d p) {
  const Vec2d q = Tilted(placement.axis, p) - placement.low;
  return {q.x * placement.scale.x + placement.offset.x, q.y * placement.scale.y + placement.offset.y};
}

double Snapped(double texels) {
  const double whole = std::round(texels);
  return whole >= 1 && std::abs(whole - texels) <= kSnapShare * texels ? whole : texels;
}

// Turns the chart's axis by a share of a quarter turn; `size` is what it then needs in input units.
Vec2d Tilt(const PackItem& item, double share, Placement& placement) {
  placement.axis = {std::cos(share * kPi / 2), std::sin(share * kPi / 2)};
  if (share == 0) return item.size;
  Vec2d low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const Segment2& segment : item.outline)
    for (const Vec2d p : segment) {
      const Vec2d q = Tilted(placement.axis, p);
      low = {std::min(low.x, q.x), std::min(low.y, q.y)};
      high = {std::max(high.x, q.x), std::max(high.y, q.y)};
    }
  placement.low = low;
  return high - low;
}

void ChooseScale(const PackItem& item, const Raster& raster, Vec2d size, Placement& placement) {
  double scale = raster.texels_per_unit * item.density;
  const double longest = std::max(item.size.x, item.size.y) * scale;
  // Half a texel of slack, so that what ends a rounding error above the limit does not touch one more.
  if (longest > raster.max_size - 0.5) scale *= (raster.max_size - 0.5) / longest;
  placement.scale = {scale, scale};
  if (!item.rectangle) return;
  if (size.x > 0) placement.scale.x = Snapped(size.x * scale) / size.x;
  if (size.y > 0) placement.scale.y = Snapped(size.y * scale) / size.y;
}

Bitmap CoverOf(const PackItem& item, const Placement& placement) {
  std::vector<Segment2> texels(item.outline);
  for (Segment2& segment : texels)
    for (Vec2d& p : segment) p = Scaled(placement, p);
  return RasterizeCover(texels);
}

struct BlockFit {
  Bitmap blocks;
  int shift_x = 0, shift_y = 0;
};

// The shift inside a block at which the texels take the fewest blocks.
BlockFit FewestBlocks(const Bitmap& texels, int cell) {
  BlockFit best;
  int64_t least = std::numeric_limits<int64_t>::max();
  for (int y = 0; y < cell; ++y)
    for (int x = 0; x < cell; ++x) {
      Bitmap blocks = ToBlocks(texels, cell, x, y);
      const int64_t count = blocks.Count();
      if (count >= least) continue;
      least = count;
      best = {std::move(blocks), x, y};
    }
  return best;
}

void AddTurns(Bitmap test, int gutter, bool turn, Placement placement, Candidate& candidate) {
  const bool full = test.Count() == int64_t{test.width()} * test.height();
  const int turns = !turn ? 1 : full ? (test.width() == test.height() ? 1 : 2) : 4;
  for (int q = 0; q < turns; ++q) {
    if (q > 0) test = TurnQuarter(test);
    placement.quarters = q;
    candidate.poses.push_back({MakeShape(test, Dilate(test, gutter), -gutter), placement});
  }
}

void AddPoses(const PackItem& item, const Raster& raster, double share, Candidate& candidate) {
  Placement placement;
  ChooseScale(item, raster, Tilt(item, share, placement), placement);
  Bitmap cover = CoverOf(item, placement);
  if (raster.cell == 1) {
    placement.footprint = {double(cover.width()), double(cover.height())};
    if (candidate.poses.empty()) candidate.cells = cover.Count();
    return AddTurns(std::move(cover), raster.gutter, raster.turn, placement, candidate);
  }
  // Blocks: each chart takes half the gutter with it, so that disjoint blocks keep the whole.
  const int half = (raster.gutter + 1) / 2;
  BlockFit fit = FewestBlocks(Dilate(cover, half), raster.cell);
  placement.offset = {double(half + fit.shift_x), double(half + fit.shift_y)};
  placement.footprint = Vec2d{double(fit.blocks.width()), double(fit.blocks.height())} * double(raster.cell);
  if (candidate.poses.empty()) candidate.cells = fit.blocks.Count();
  AddTurns(std::move(fit.blocks), 0, raster.turn, placement, candidate);
}

}  // namespace

Vec2d ToPage(const Placement& placement, Vec2d p) {
  Vec2d q = Scaled(placement, p), size = placement.footprint;
  for (int i = 0; i < placement.quarters; ++i) {
    q = {size.y - q.y, q.x};
    size = {size.y, size.x};
  }
  return q + placement.corner;
}

Candidate MakeCandidate(const PackItem& item, const Raster& raster) {
  Candidate candidate;
  const int tilts = item.rectangle || !raster.turn ? 1 : raster.tilts;
  for (int i = 0; i < tilts; ++i) AddPoses(item, raster, double(i) / tilts, candidate);
  return candidate;
}

}  // namespace bakewell::chart
