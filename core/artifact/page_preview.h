#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/math/vec.h"

namespace bakewell {

// What a task knows of a lightmap page before the page is made: colours of its blocks of 2 x 2 texels, for people to
// look at while they wait. No result depends on it.
struct PagePreview {
  struct Block {
    uint16_t x = 0, y = 0;  // in blocks, row 0 on top
    Rgb irradiance;         // mean of the block's texels [W m^-2]
  };
  uint16_t width = 0, height = 0;  // of the page, in blocks
  std::vector<Block> blocks;
};

// Gathers texels of one page, block by block within 16 x 16 tiles, as TexelMap has them in order.
class PreviewBuilder {
 public:
  PreviewBuilder(int width, int height);  // of the page, in texels, at least 1
  void Add(int x, int y, Rgb irradiance);
  PagePreview Take();

 private:
  struct Sum {
    Rgb irradiance;
    float texels = 0;
  };
  void Flush();

  PagePreview preview_;
  int tile_x_ = -1, tile_y_ = -1;
  std::vector<Sum> tile_;  // 8 x 8 blocks
};

// 8 bytes a block, colours to 8 bits with a shared exponent. Parse is safe on hostile bytes (kDataLoss): every block
// lies on the page, and colours are finite.
std::string SerializePreview(const PagePreview& preview);
absl::StatusOr<PagePreview> ParsePreview(std::string_view bytes);

}  // namespace bakewell
