#include "worker/filter/smooth_tile.h"

#include <utility>

#include "worker/filter/connect.h"

namespace bakewell {

SmoothTile::SmoothTile(const TexelMap& map, uint32_t begin, uint32_t end)
    : map_(map),
      begin_(begin),
      end_(end),
      left_(map.texels[begin].x / kTileSide * kTileSide - SmoothGrid::kMostRadius),
      top_(map.texels[begin].y / kTileSide * kTileSide - SmoothGrid::kMostRadius) {}

SmoothTile::SmoothTile(const SmoothTile& connected, Signal signal) : SmoothTile(connected) {
  grid_ = SmoothGrid(std::move(grid_), signal);
}

// -1 where there is no texel.
int32_t SmoothTile::TexelAt(int x, int y) const {
  const Texel& first = map_.texels[begin_];
  const PageSize page = map_.pages[first.page];
  if (x < 0 || y < 0 || x >= page.width || y >= page.height) return -1;
  return map_.texel_at[first.page][static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x)];
}

SmoothCell& SmoothTile::CellOf(size_t i) {
  const Texel& texel = map_.texels[begin_ + i];
  return grid_.At(texel.x - left_, texel.y - top_);
}

std::vector<uint8_t> SmoothTile::Connect(const World& world, const std::vector<bool>& valid,
                                         const std::vector<bool>& crowded, int64_t& rays) {
  std::vector<uint8_t> open(end_ - begin_, 0);
  for (int y = 0; y < grid_.height(); ++y) {
    for (int x = 0; x < grid_.width(); ++x) {
      const int32_t at = TexelAt(left_ + x, top_ + y);
      if (at < 0) continue;
      const uint32_t texel = static_cast<uint32_t>(at);
      if (!IsMine(texel)) {
        ConnectCell(x, y, texel, valid, 0xf);
      } else if (valid[texel - begin_]) {
        open[texel - begin_] = ConnectTexel(world, map_, texel, crowded[texel - begin_], rays);
        ConnectCell(x, y, texel, valid, open[texel - begin_]);
      }
    }
  }
  grid_.MeasureRoom();
  return open;
}

void SmoothTile::ConnectCell(int x, int y, uint32_t texel, const std::vector<bool>& valid, uint8_t open) {
  for (int k = 0; k < 4; ++k) {
    const int32_t at = TexelAt(left_ + x + kNeighbours[k][0], top_ + y + kNeighbours[k][1]);
    if (at < 0 || map_.texels[at].chart != map_.texels[texel].chart) continue;
    const uint32_t other = static_cast<uint32_t>(at);
    if (IsMine(other) && !valid[other - begin_]) continue;
    if (open >> k & 1) grid_.Connect(x, y, k);
  }
}

void SmoothTile::Put(size_t i, float value, float variance) {
  SmoothCell& cell = CellOf(i);
  cell.known = true;
  cell.value = value;
  cell.variance = variance;
}

template <typename Visit>
void SmoothTile::ForEachKnown(Visit visit) {
  for (size_t i = 0; i < end_ - begin_; ++i) {
    const Texel& texel = map_.texels[begin_ + i];
    if (CellOf(i).known) visit(i, texel.x - left_, texel.y - top_);
  }
}

std::vector<SmoothGrid::Smoothed> SmoothTile::Smooth() {
  std::vector<SmoothGrid::Smoothed> result(end_ - begin_);
  std::vector<SmoothGrid::Calm> calm(result.size());
  ForEachKnown([&](size_t i, int x, int y) { calm[i] = grid_.Calmed(x, y); });
  ForEachKnown([&](size_t i, int x, int y) { grid_.Take(x, y, calm[i]); });
  std::vector<SmoothGrid::Steps> steps(result.size());
  ForEachKnown([&](size_t i, int x, int y) { CellOf(i).radius = grid_.Choose(x, y, &steps[i]); });
  ForEachKnown([&](size_t i, int x, int y) { result[i] = grid_.SmoothedAt(x, y, grid_.Agree(x, y), steps[i]); });
  return result;
}

}  // namespace bakewell
