#include "worker/texel/pages.h"

#include <algorithm>

namespace bakewell {

TexelPages::TexelPages(const World& world, const AtlasLayout& layout, float footprint)
    : world_(world), layout_(layout), footprint_(footprint) {
  for (int page = 0; page < static_cast<int>(layout.pages.size()); ++page) {
    auto map = std::make_shared<const TexelMap>(RasterizeTexels(world_, layout_, footprint_, page));
    PageCount count;
    count.first_texel = texel_count();
    count.first_tile = tile_count();
    count.texels = std::ssize(map->texels);
    count.overlapping_texels = map->overlapping_texels;
    for (int tile = 0; tile < map->tile_count(); ++tile) {
      count.texels_of_tile.push_back(map->tile_begin[tile + 1] - map->tile_begin[tile]);
    }
    pages_.push_back(std::move(count));
    Keep(page, std::move(map));
  }
}

int TexelPages::PageOfTile(int tile) const {
  const auto page =
      std::upper_bound(pages_.begin(), pages_.end(), tile, [](int t, const PageCount& p) { return t < p.end_tile(); });
  return static_cast<int>(page - pages_.begin());
}

std::shared_ptr<const TexelMap> TexelPages::Page(int page) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.page == page; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
  } else {
    Keep(page, std::make_shared<const TexelMap>(RasterizeTexels(world_, layout_, footprint_, page)));
  }
  return kept_.front().map;
}

void TexelPages::Keep(int page, std::shared_ptr<const TexelMap> map) const {
  kept_.push_front({page, std::move(map)});
  int64_t texels = 0;
  const auto beyond = std::find_if(std::next(kept_.begin()), kept_.end(), [&](const Kept& k) {
    texels += pages_[static_cast<size_t>(k.page)].texels;
    return texels + pages_[static_cast<size_t>(kept_.front().page)].texels > kKeptTexels;
  });
  kept_.erase(beyond, kept_.end());
}

}  // namespace bakewell
