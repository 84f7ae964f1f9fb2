#include "worker/filter/smooth_tile.h"

#include <array>

#include "worker/filter/connect.h"

namespace bakewell {

SmoothTile::SmoothTile(const TexelMap& map, uint32_t begin, uint32_t end)
    : map_(map),
      begin_(begin),
      end_(end),
      left_(map.texels[begin].x / kTileSide * kTileSide),
      top_(map.texels[begin].y / kTileSide * kTileSide) {}

// -1 where there is no texel.
int32_t SmoothTile::TexelAt(int x, int y) const {
  const Texel& first = map_.texels[begin_];
  const PageSize page = map_.pages[first.page];
  if (x < 0 || y < 0 || x >= page.width || y >= page.height) return -1;
  return map_.texel_at[first.page][static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x)];
}

std::vector<uint8_t> SmoothTile::Connect(const World& world, const std::vector<bool>& valid,
                                         const std::vector<bool>& crowded, int64_t& rays) {
  valid_ = valid;
  open_.assign(valid.size(), 0);
  for (uint32_t i = 0; i < end_ - begin_; ++i) {
    if (valid[i]) open_[i] = ConnectTexel(world, map_, begin_ + i, crowded[i], rays);
  }
  return open_;
}

// The tile, and as far around it as windows reach.
Connections SmoothTile::Grid() const {
  Connections grid(kTileSide + 2 * kWindowRadius, kTileSide + 2 * kWindowRadius);
  for (int y = 0; y < grid.height(); ++y) {
    for (int x = 0; x < grid.width(); ++x) {
      const int32_t at = TexelAt(left_ - kWindowRadius + x, top_ - kWindowRadius + y);
      if (at >= 0) ConnectCell(x, y, static_cast<uint32_t>(at), grid);
    }
  }
  grid.Finish();
  return grid;
}

// Texels of other tiles count as connected.
void SmoothTile::ConnectCell(int x, int y, uint32_t texel, Connections& grid) const {
  const Texel& from = map_.texels[texel];
  const uint8_t open = IsMine(texel) ? open_[texel - begin_] : 0xf;
  for (int k = 0; k < 4; ++k) {
    if (!(open >> k & 1)) continue;
    const int32_t at = TexelAt(from.x + kNeighbours[k][0], from.y + kNeighbours[k][1]);
    if (at < 0 || map_.texels[at].chart != from.chart) continue;
    const uint32_t other = static_cast<uint32_t>(at);
    if (!IsMine(other) || valid_[other - begin_]) grid.Connect(x, y, k);
  }
}

void SmoothTile::Locate(const Connections& grid) {
  constexpr size_t kRow = kTileSide + 2 * kWindowRadius;
  std::array<int32_t, kRow * kRow> part, known{};
  const auto at = [](int x, int y) {
    return static_cast<size_t>(y + kWindowRadius) * kRow + static_cast<size_t>(x + kWindowRadius);
  };
  for (int y = -kWindowRadius; y < kTileSide + kWindowRadius; ++y) {
    for (int x = -kWindowRadius; x < kTileSide + kWindowRadius; ++x) {
      part[at(x, y)] = grid.PartOf(x + kWindowRadius, y + kWindowRadius);
    }
  }
  places_.resize(end_ - begin_);
  for (size_t i = 0; i < places_.size(); ++i) {
    if (!valid_[i]) continue;
    Place& place = places_[i];
    place.x = map_.texels[begin_ + i].x - left_;
    place.y = map_.texels[begin_ + i].y - top_;
    place.part = static_cast<uint16_t>(part[at(place.x, place.y)]);
    place.cut = grid.CutOff(place.x + kWindowRadius, place.y + kWindowRadius);
    known[at(place.x, place.y)] = 1;
  }
  // By nearness, of each window's texels: those that are of its part, and of these the known ones.
  std::array<std::array<float, kTileSide>, kTileSide> all{}, here{};
  for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
    for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
      const float nearness = SimilarTexels::Nearness(dx, dy);
      for (int y = 0; y < kTileSide; ++y) {
        const int32_t *own = &part[at(0, y)], *other = &part[at(dx, y + dy)], *is_known = &known[at(dx, y + dy)];
        for (size_t x = 0; x < kTileSide; ++x) {
          const float counts = own[x] == other[x] ? nearness : 0.0f;
          all[static_cast<size_t>(y)][x] += counts;
          here[static_cast<size_t>(y)][x] += is_known[x] != 0 ? counts : 0.0f;
        }
      }
    }
  }
  for (Place& place : places_) {
    if (place.part == 0) continue;
    float of_all = all[static_cast<size_t>(place.y)][static_cast<size_t>(place.x)];
    float of_here = here[static_cast<size_t>(place.y)][static_cast<size_t>(place.x)];
    for (size_t index = 0; place.cut.any() && index < kWindow; ++index) {
      if (!place.cut[index]) continue;
      const int dx = static_cast<int>(index) % kWindowSide - kWindowRadius;
      const int dy = static_cast<int>(index) / kWindowSide - kWindowRadius;
      of_all -= SimilarTexels::Nearness(dx, dy);
      of_here -= known[at(place.x + dx, place.y + dy)] != 0 ? SimilarTexels::Nearness(dx, dy) : 0;
    }
    place.known = of_here / of_all;
  }
}

std::vector<SimilarTexels::Mean> SmoothTile::Smooth(const std::vector<float>& value, const std::vector<float>& variance,
                                                    float margin) {
  if (places_.empty()) Locate(Grid());
  thread_local SimilarTexels texels(kTileSide, kTileSide);
  texels.Clear();
  for (size_t i = 0; i < places_.size(); ++i) {
    if (places_[i].part != 0) texels.Put(places_[i].x, places_[i].y, value[i], variance[i], places_[i].part);
  }
  texels.Compare(false);
  for (const Place& place : places_) {
    if (place.cut.any()) texels.CutOff(place.x, place.y, place.cut);
  }
  texels.Regress(margin);
  std::vector<SimilarTexels::Mean> means(places_.size());
  for (size_t i = 0; i < places_.size(); ++i) {
    const Place& place = places_[i];
    if (place.part == 0) {
      means[i] = {value[i], 1, 1, variance[i]};
      continue;
    }
    means[i] = texels.MeanOf(place.x, place.y);
    means[i].variance *= place.known;
    means[i].square *= place.known;
  }
  return means;
}

}  // namespace bakewell
