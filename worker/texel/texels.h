#pragma once

#include <cstdint>
#include <vector>

#include "core/atlas/layout.h"
#include "core/base/status.h"
#include "worker/trace/world.h"

namespace bakewell {

// The part of one triangle inside one texel.
struct TexelFragment {
  uint32_t triangle = 0;  // World::triangles()
  float coverage = 0;     // share of the texel's square, (0, 1]
};

// A texel with any coverage. Vectors are in the scene's frame.
struct Texel {
  int16_t page = 0;
  int32_t x = 0, y = 0;
  int32_t chart = kNoChart;
  uint32_t fragment_begin = 0, fragment_end = 0;  // TexelMap::fragments
  float coverage = 0;   // share of the square that triangles cover, (0, 1] (above 1 where charts overlap)
  float area = 0;       // of the covered surface [m^2]
  Vec3f position;       // centroid of the covered surface [m]
  Vec3f normal;         // unit, geometric, area-weighted
  Vec3f smooth_normal;  // unit, interpolated shading normal
  bool flat = true;     // all fragments share the normal
};

// All covered texels of a layout, sorted by page, then tile (16 x 16 texels, row by row), then y, x.
struct TexelMap {
  std::vector<PageSize> pages;
  std::vector<Texel> texels;
  std::vector<TexelFragment> fragments;
  // Per page, width * height: index into texels or -1.
  std::vector<std::vector<int32_t>> texel_at;
  // Texels [tile_begin[k], tile_begin[k+1]) are tile k.
  std::vector<uint32_t> tile_begin;
  int64_t overlapping_texels = 0;  // covered by more than one chart
  float footprint = 1;             // side of the square about a texel's centre that its value averages [texels]

  int tile_count() const { return static_cast<int>(tile_begin.size()) - 1; }
};

inline constexpr int kTileSide = 16;

inline constexpr int kAllPages = -1;

// Rasterises every charted triangle exactly: area of texel and triangle clipped, not centres. footprint is in (0, 1].
// Of one page only, where it is named: the same texels, numbered from that page's first; other pages' texel_at is
// empty.
TexelMap RasterizeTexels(const World& world, const AtlasLayout& layout, float footprint, int page = kAllPages);

// Corners of a charted triangle on its page [texels].
std::array<Vec2d, 3> TexelCorners(const World& world, const AtlasLayout& layout, uint32_t triangle);

}  // namespace bakewell
