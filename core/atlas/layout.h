#pragma once

#include <cstdint>
#include <vector>

#include "core/math/vec.h"

namespace bakewell {

// A point on a page in texels: texel (x, y) covers [x, x+1) x [y, y+1), y down, row 0 is v = 0 (theory.md 1).
struct TexelUv {
  float x = 0, y = 0;
  friend constexpr bool operator==(const TexelUv&, const TexelUv&) = default;
};

struct PageSize {
  int width = 0, height = 0;
  friend constexpr bool operator==(const PageSize&, const PageSize&) = default;
};

inline constexpr int32_t kNoChart = -1;

// The charts of one Scene::objects entry. Vertices are split where charts meet: vertex i of the charted mesh is vertex
// xref[i] of the object. Triangle k of the charted mesh is triangle k of the object.
struct ObjectCharts {
  std::vector<uint32_t> xref;              // V'
  std::vector<TexelUv> uv;                 // V'
  std::vector<uint32_t> index;             // 3 T, into xref and uv
  std::vector<int32_t> chart_of_triangle;  // T, into AtlasLayout::charts, or kNoChart
};

struct Chart {
  int page = 0;
  int object = 0;
};

// Where every lightmapped triangle lies. Objects that are not lightmapped have empty vectors.
struct AtlasLayout {
  std::vector<PageSize> pages;
  std::vector<Chart> charts;
  std::vector<ObjectCharts> objects;  // one per Scene::objects
  float texels_per_metre = 0;         // area-weighted mean density
};

}  // namespace bakewell
