#pragma once

#include <span>
#include <vector>

#include "worker/filter/window.h"
#include "worker/texel/texels.h"

namespace bakewell {

// What the filter will make of one tile's texels, of their indirect light unless told otherwise, as far as the tile can
// tell: around it, as far as a window reaches, lie places without values.
class SmoothTile {
 public:
  // Texels [begin, end) of the map are the tile.
  SmoothTile(const TexelMap& map, uint32_t begin, uint32_t end);
  // The same tile, connected, for another signal; before the first Put.
  SmoothTile(const SmoothTile& connected, Signal signal);

  // Connects neighbours. valid, crowded (Surroundings): one flag a texel of the tile. Returns ConnectTexel's bits, one
  // element a texel.
  std::vector<uint8_t> Connect(const World& world, const std::vector<bool>& valid, const std::vector<bool>& crowded,
                               int64_t& rays);

  // The value of texel `i` of the tile and its variance, before filtering. Only of valid texels.
  void Put(size_t i, float value, float variance);

  // The values and variances after filtering, one element a texel of the tile; those without a value are not computed.
  std::vector<SmoothGrid::Smoothed> Smooth();

 private:
  int32_t TexelAt(int x, int y) const;
  bool IsMine(uint32_t texel) const { return texel >= begin_ && texel < end_; }
  SmoothCell& CellOf(size_t i);
  void ConnectCell(int x, int y, uint32_t texel, const std::vector<bool>& valid, uint8_t open);
  template <typename Visit>
  void ForEachKnown(Visit visit);

  const TexelMap& map_;
  const uint32_t begin_, end_;
  int left_, top_;  // of the grid, on the page
  SmoothGrid grid_{kTileSide + 2 * SmoothGrid::kMostRadius, kTileSide + 2 * SmoothGrid::kMostRadius, Signal::kIndirect};
};

}  // namespace bakewell
