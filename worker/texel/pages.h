#pragma once

#include <list>
#include <memory>
#include <mutex>

#include "worker/texel/texels.h"

namespace bakewell {

// The texels of a layout, a page at a time: all of them together may need more memory than a machine has. Pages are
// rasterised when they are asked for, and those used last are kept, at least one and at most kKeptTexels texels. Safe
// to ask from any number of threads. `world` and `layout` outlive it.
class TexelPages {
 public:
  static constexpr int64_t kKeptTexels = int64_t{1} << 22;

  // Rasterises every page once, to count.
  TexelPages(const World& world, const AtlasLayout& layout, float footprint);

  // Tiles and texels of the level are numbered page by page, as RasterizeTexels numbers them.
  struct PageCount {
    int64_t first_texel = 0, texels = 0;
    int first_tile = 0;
    std::vector<uint32_t> texels_of_tile;
    int64_t overlapping_texels = 0;  // covered by more than one chart
    int end_tile() const { return first_tile + static_cast<int>(texels_of_tile.size()); }
  };
  const std::vector<PageCount>& pages() const { return pages_; }
  int64_t texel_count() const { return pages_.empty() ? 0 : pages_.back().first_texel + pages_.back().texels; }
  int tile_count() const { return pages_.empty() ? 0 : pages_.back().end_tile(); }
  // The page that holds a tile of [0, tile_count()).
  int PageOfTile(int tile) const;

  // A page's texels; tiles and texels count from the page's own first.
  std::shared_ptr<const TexelMap> Page(int page) const;

 private:
  const World& world_;
  const AtlasLayout& layout_;
  const float footprint_;
  std::vector<PageCount> pages_;
  struct Kept {
    int page;
    std::shared_ptr<const TexelMap> map;
  };
  void Keep(int page, std::shared_ptr<const TexelMap> map) const;
  mutable std::mutex mutex_;
  mutable std::list<Kept> kept_;  // the one used last in front
};

}  // namespace bakewell
