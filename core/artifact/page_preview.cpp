#include "core/artifact/page_preview.h"

#include <algorithm>
#include <cmath>

#include "core/base/fields.h"

namespace bakewell {

namespace {

constexpr int kBlock = 2, kTile = 16, kBlocksPerTile = kTile / kBlock;
constexpr size_t kBlockBytes = 8;
constexpr int kExponentBias = 128;

// Radiance's RGBE (Ward 1991, "Real Pixels"): mantissas of R, G, B and the exponent that they share, from low to high.
uint32_t Packed(const Rgb& color) {
  const float most = std::max({color.x, color.y, color.z});
  if (!(most > 1e-30f) || !std::isfinite(most)) return 0;
  int exponent = 0;
  const float scale = std::frexp(most, &exponent) * 256 / most;
  const auto mantissa = [&](float c) { return static_cast<uint32_t>(std::clamp(c * scale, 0.0f, 255.0f)); };
  return mantissa(color.x) | mantissa(color.y) << 8 | mantissa(color.z) << 16 |
         static_cast<uint32_t>(std::clamp(exponent + kExponentBias, 1, 255)) << 24;
}

Rgb Unpacked(uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 24);
  if (exponent == 0) return {};
  const auto value = [&](uint32_t byte) {
    return std::ldexp(static_cast<float>(byte & 255) + 0.5f, exponent - kExponentBias - 8);
  };
  return {value(bits), value(bits >> 8), value(bits >> 16)};
}

uint16_t BlocksOf(int texels) { return static_cast<uint16_t>(std::clamp((texels + kBlock - 1) / kBlock, 1, 65535)); }

}  // namespace

PreviewBuilder::PreviewBuilder(int width, int height)
    : preview_{BlocksOf(width), BlocksOf(height), {}}, tile_(kBlocksPerTile * kBlocksPerTile) {}

void PreviewBuilder::Add(int x, int y, Rgb irradiance) {
  if (x / kTile != tile_x_ || y / kTile != tile_y_) Flush();
  tile_x_ = x / kTile;
  tile_y_ = y / kTile;
  Sum& sum = tile_[static_cast<size_t>((y % kTile) / kBlock * kBlocksPerTile + (x % kTile) / kBlock)];
  sum.irradiance += irradiance;
  ++sum.texels;
}

void PreviewBuilder::Flush() {
  for (int i = 0; i < kBlocksPerTile * kBlocksPerTile; ++i) {
    Sum& sum = tile_[static_cast<size_t>(i)];
    if (sum.texels == 0) continue;
    preview_.blocks.push_back({static_cast<uint16_t>(tile_x_ * kBlocksPerTile + i % kBlocksPerTile),
                               static_cast<uint16_t>(tile_y_ * kBlocksPerTile + i / kBlocksPerTile),
                               sum.irradiance / sum.texels});
    sum = {};
  }
}

PagePreview PreviewBuilder::Take() {
  Flush();
  return std::move(preview_);
}

std::string SerializePreview(const PagePreview& preview) {
  FieldWriter writer;
  writer.Put(preview.width);
  writer.Put(preview.height);
  for (const PagePreview::Block& block : preview.blocks) {
    writer.Put(block.x);
    writer.Put(block.y);
    writer.Put(Packed(block.irradiance));
  }
  return std::move(writer).bytes();
}

absl::StatusOr<PagePreview> ParsePreview(std::string_view bytes) {
  FieldReader reader(bytes);
  PagePreview preview;
  preview.width = reader.Get<uint16_t>();
  preview.height = reader.Get<uint16_t>();
  preview.blocks.resize(reader.remaining() / kBlockBytes);
  bool inside = preview.width > 0 && preview.height > 0;
  for (PagePreview::Block& block : preview.blocks) {
    block.x = reader.Get<uint16_t>();
    block.y = reader.Get<uint16_t>();
    block.irradiance = Unpacked(reader.Get<uint32_t>());
    inside = inside && block.x < preview.width && block.y < preview.height;
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("page preview"));
  if (!inside) return absl::DataLossError("page preview: a block lies outside of its page");
  return preview;
}

}  // namespace bakewell
