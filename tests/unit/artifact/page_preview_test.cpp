#include "core/artifact/page_preview.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace bakewell {
namespace {

TEST(PagePreview, BlocksAreMeansOfTheirTexelsInEveryTile) {
  PreviewBuilder builder(37, 20);
  for (int tile_x = 0; tile_x < 3; ++tile_x) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 16 * tile_x; x < std::min(37, 16 * tile_x + 16); ++x) {
        const auto value = static_cast<float>(x % 2 + 2 * (y % 2) + 10 * tile_x);  // block mean 1.5 + 10 tile
        builder.Add(x, y, {value, value, value});
      }
    }
  }
  const PagePreview preview = builder.Take();
  EXPECT_EQ(preview.width, 19);
  EXPECT_EQ(preview.height, 10);
  EXPECT_EQ(preview.blocks.size(), 19u * 8u);
  for (const PagePreview::Block& block : preview.blocks) {
    // The last column of texels has no right neighbour.
    EXPECT_FLOAT_EQ(block.irradiance.x, block.x == 18 ? 21 : 1.5f + 10.0f * static_cast<float>(block.x / 8));
  }
}

TEST(PagePreview, ColoursComeBackToTheirBits) {
  PagePreview preview{8, 4, {}};
  const std::vector<Rgb> colors = {{1, 2, 3}, {1e-6f, 0, 0}, {1e6f, 1e5f, 7}, {0, 0, 0}, {100, 100, 100}};
  for (size_t i = 0; i < colors.size(); ++i) preview.blocks.push_back({static_cast<uint16_t>(i), 3, colors[i]});
  const std::string bytes = SerializePreview(preview);
  EXPECT_EQ(bytes.size(), 4 + 8 * colors.size());
  const auto read = ParsePreview(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->width, 8);
  ASSERT_EQ(read->blocks.size(), colors.size());
  for (size_t i = 0; i < colors.size(); ++i) {
    const Rgb &was = colors[i], &is = read->blocks[i].irradiance;
    const float most = std::max({was.x, was.y, was.z}), step = most / 128;  // 8 bits below the largest
    EXPECT_NEAR(is.x, was.x, step);
    EXPECT_NEAR(is.y, was.y, step);
    EXPECT_NEAR(is.z, was.z, step);
    EXPECT_EQ(read->blocks[i].x, i);
  }
}

TEST(PagePreview, HostileBytesAreRefused) {
  const std::string valid = SerializePreview({2, 2, {{1, 1, {1, 1, 1}}}});
  EXPECT_TRUE(ParsePreview(valid).ok());
  for (size_t size = 0; size < valid.size(); ++size) {
    const bool whole = size == 4;  // a page of which nothing is known
    EXPECT_EQ(ParsePreview(valid.substr(0, size)).ok(), whole) << size;
  }
  EXPECT_FALSE(ParsePreview(SerializePreview({2, 2, {{2, 1, {}}}})).ok()) << "right of the page";
  EXPECT_FALSE(ParsePreview(SerializePreview({2, 2, {{0, 9, {}}}})).ok()) << "below the page";
  EXPECT_FALSE(ParsePreview(std::string(4, '\0')).ok()) << "a page of nothing";
}

}  // namespace
}  // namespace bakewell
