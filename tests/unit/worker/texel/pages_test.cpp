#include "worker/texel/pages.h"

#include <gtest/gtest.h>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {
namespace {

constexpr int kSide = 40, kQuads = 3;

// Three quads, each on a page of its own.
PreparedLevel ThreePages() {
  SceneBuilder builder({kSide, kSide});
  for (int i = 0; i < kQuads; ++i) {
    const float row = 13.0f * static_cast<float>(i);
    builder.AddQuad({4.0 * i, 0, 0}, {3, 0, 0}, {0, 0, -2}, {.page = {2.5f, row, 30, 12.25f}});
  }
  PreparedLevel prepared = PrepareInMemory(builder.Build(), {});
  prepared.layout.pages.assign(kQuads, {kSide, kSide});
  for (int i = 0; i < kQuads; ++i) prepared.layout.charts[static_cast<size_t>(i)].page = i;
  return prepared;
}

TEST(TexelPages, PagesAreThoseOfTheWhole) {
  const PreparedLevel prepared = ThreePages();
  ASSERT_EQ(prepared.layout.charts.size(), size_t{kQuads});
  const TexelMap whole = RasterizeTexels(*prepared.world, prepared.layout, 0.5f);
  const TexelPages pages(*prepared.world, prepared.layout, 0.5f);
  ASSERT_EQ(pages.texel_count(), std::ssize(whole.texels));
  ASSERT_EQ(pages.tile_count(), whole.tile_count());
  for (int tile = 0; tile < whole.tile_count(); ++tile) {
    const Texel& first = whole.texels[whole.tile_begin[static_cast<size_t>(tile)]];
    ASSERT_EQ(pages.PageOfTile(tile), first.page);
    const auto& count = pages.pages()[static_cast<size_t>(first.page)];
    const auto page = pages.Page(first.page);
    const size_t local = static_cast<size_t>(tile - count.first_tile);
    ASSERT_EQ(whole.tile_begin[static_cast<size_t>(tile)],
              static_cast<uint32_t>(count.first_texel) + page->tile_begin[local]);
    EXPECT_EQ(count.texels_of_tile[local], page->tile_begin[local + 1] - page->tile_begin[local]);
    const Texel& same = page->texels[page->tile_begin[local]];
    EXPECT_EQ(std::tuple(first.page, first.x, first.y, first.chart), std::tuple(same.page, same.x, same.y, same.chart));
    EXPECT_EQ(whole.fragments[first.fragment_begin].triangle, page->fragments[same.fragment_begin].triangle);
  }
}

TEST(TexelPages, PagesThatWereDroppedComeBackTheSame) {
  const PreparedLevel prepared = ThreePages();
  const TexelPages pages(*prepared.world, prepared.layout, 0.5f);
  for (const int page : {2, 0, 1, 0, 2}) {
    const auto map = pages.Page(page);
    ASSERT_EQ(std::ssize(map->texels), pages.pages()[static_cast<size_t>(page)].texels);
    EXPECT_EQ(map->texels.front().page, page);
    EXPECT_EQ(map->texel_at[static_cast<size_t>(page)].size(), size_t{kSide * kSide});
    EXPECT_TRUE(map->texel_at[static_cast<size_t>((page + 1) % kQuads)].empty());
  }
}

}  // namespace
}  // namespace bakewell
