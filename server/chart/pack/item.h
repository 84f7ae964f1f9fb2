#pragma once

#include <vector>

#include "core/math/vec.h"
#include "server/chart/options.h"
#include "server/chart/pack/footprint.h"
#include "server/chart/pack/page.h"

namespace bakewell::chart {

// A chart as the packer sees it. Lengths in input units, least coordinate 0 on both axes, upright.
struct PackItem {
  std::vector<Segment2> outline;
  Vec2d size{0, 0};
  double area = 0;
  double density = 1;      // factor on the page's density
  bool rectangle = false;  // its outline is its bounding box
};

// From input units to texels on a page: scale, turn, then move. The turn is about the footprint's corner:
// one quarter takes (x, y) to (turn_height - y, x).
struct Placement {
  int page = 0;
  Vec2d scale{1, 1};   // texels per input unit along the chart's own axes
  Vec2d offset{0, 0};  // texels, before the turn
  int quarters = 0;
  Vec2d footprint{0, 0};  // texels, width and height before the turn, whole numbers
  Vec2d corner{0, 0};     // texels, whole numbers
};

Vec2d ToPage(const Placement& placement, Vec2d p);

// A chart at one density: its shapes for 0 to 3 quarter turns, and how its texels relate to its own plane.
struct Candidate {
  std::vector<Shape> turns;
  Placement placement;  // scale, offset and footprint are set
  int64_t cells = 0;
};

// cell: 1, or 4 where no two charts may share a 4x4 block. max_size: texels, longer charts are scaled down.
struct Raster {
  double texels_per_unit = 1;
  int cell = 1, gutter = 2, max_size = 1024;
  bool turn = true;
};

Candidate MakeCandidate(const PackItem& item, const Raster& raster);

}  // namespace bakewell::chart
