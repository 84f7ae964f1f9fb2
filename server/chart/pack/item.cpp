#include "server/chart/pack/item.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bakewell::chart {
namespace {

// How far a rectangle's side may be scaled so that both its ends lie on texel borders: with it densities stay within
// 1 % of one another.
constexpr double kSnapShare = 0.0045;

double Snapped(double texels) {
  const double whole = std::round(texels);
  return whole >= 1 && std::abs(whole - texels) <= kSnapShare * texels ? whole : texels;
}

void ChooseScale(const PackItem& item, const Raster& raster, Placement& placement) {
  double scale = raster.texels_per_unit * item.density;
  const double longest = std::max(item.size.x, item.size.y) * scale;
  // A texel of slack, so that what ends a rounding error above the limit does not touch one more.
  if (longest > raster.max_size - 0.5) scale *= (raster.max_size - 0.5) / longest;
  placement.scale = {scale, scale};
  if (!item.rectangle) return;
  if (item.size.x > 0) placement.scale.x = Snapped(item.size.x * scale) / item.size.x;
  if (item.size.y > 0) placement.scale.y = Snapped(item.size.y * scale) / item.size.y;
}

Bitmap CoverOf(const PackItem& item, const Placement& placement) {
  std::vector<Segment2> texels(item.outline);
  for (Segment2& segment : texels)
    for (Vec2d& p : segment)
      p = {p.x * placement.scale.x + placement.offset.x, p.y * placement.scale.y + placement.offset.y};
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

void AddTurns(Bitmap test, int gutter, bool turn, Candidate& candidate) {
  const bool full = test.Count() == int64_t{test.width()} * test.height();
  const int turns = !turn ? 1 : full ? (test.width() == test.height() ? 1 : 2) : 4;
  for (int q = 0; q < turns; ++q) {
    if (q > 0) test = TurnQuarter(test);
    candidate.turns.push_back(MakeShape(test, Dilate(test, gutter), -gutter));
  }
}

}  // namespace

Vec2d ToPage(const Placement& placement, Vec2d p) {
  Vec2d q{p.x * placement.scale.x + placement.offset.x, p.y * placement.scale.y + placement.offset.y};
  Vec2d size = placement.footprint;
  for (int i = 0; i < placement.quarters; ++i) {
    q = {size.y - q.y, q.x};
    size = {size.y, size.x};
  }
  return q + placement.corner;
}

Candidate MakeCandidate(const PackItem& item, const Raster& raster) {
  Candidate candidate;
  ChooseScale(item, raster, candidate.placement);
  Bitmap cover = CoverOf(item, candidate.placement);
  if (raster.cell == 1) {
    candidate.placement.footprint = {double(cover.width()), double(cover.height())};
    candidate.cells = cover.Count();
    AddTurns(std::move(cover), raster.gutter, raster.turn, candidate);
    return candidate;
  }
  // Blocks: each chart takes half the gutter with it, so that disjoint blocks keep the whole.
  const int half = (raster.gutter + 1) / 2;
  BlockFit fit = FewestBlocks(Dilate(cover, half), raster.cell);
  candidate.placement.offset = {double(half + fit.shift_x), double(half + fit.shift_y)};
  candidate.placement.footprint = Vec2d{double(fit.blocks.width()), double(fit.blocks.height())} * double(raster.cell);
  candidate.cells = fit.blocks.Count();
  AddTurns(std::move(fit.blocks), 0, raster.turn, candidate);
  return candidate;
}

}  // namespace bakewell::chart
