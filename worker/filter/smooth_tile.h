#pragma once

#include <span>
#include <vector>

#include "worker/filter/similarity.h"
#include "worker/texel/texels.h"

namespace bakewell {

// What the filter will make of one tile's texels, of their direct or their indirect light, as far as the tile can tell:
// around it, as far as a window reaches, lie places without values.
class SmoothTile {
 public:
  // Texels [begin, end) of the map are the tile.
  SmoothTile(const TexelMap& map, uint32_t begin, uint32_t end);

  // Connects neighbours. valid, crowded (Surroundings): one flag a texel of the tile. Returns ConnectTexel's bits, one
  // element a texel.
  std::vector<uint8_t> Connect(const World& world, const std::vector<bool>& valid, const std::vector<bool>& crowded,
                               int64_t& rays);

  // value, variance: of each texel of the tile before filtering, of which only valid ones count. Returns the same after
  // filtering, one element a texel. The variance is that of the page, where texels around the tile will be as well
  // known as its own. margin: as in SimilarTexels::Regress.
  std::vector<SimilarTexels::Mean> Smooth(const std::vector<float>& value, const std::vector<float>& variance,
                                          float margin);

 private:
  struct Place {
    int x = 0, y = 0;   // in the tile
    uint16_t part = 0;  // 0: not valid, or connected to nothing
    WindowSet cut;      // Connections::CutOff
    float known = 1;    // share of its window, by nearness, that is valid texels of the tile
  };
  int32_t TexelAt(int x, int y) const;
  bool IsMine(uint32_t texel) const { return texel >= begin_ && texel < end_; }
  Connections Grid() const;
  void ConnectCell(int x, int y, uint32_t texel, Connections& grid) const;
  void Locate(const Connections& grid);

  const TexelMap& map_;
  const uint32_t begin_, end_;
  int left_, top_;  // of the tile, on the page
  // One element a texel of the tile.
  std::vector<bool> valid_;
  std::vector<uint8_t> open_;
  std::vector<Place> places_;  // once it is smoothed
};

}  // namespace bakewell
