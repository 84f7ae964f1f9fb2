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

// From input units to texels on a page: tilt, scale, quarter turns, move. A quarter turn is about the footprint's
// corner and takes (x, y) to (height - y, x).
struct Placement {
  int page = 0;
  Vec2d axis{1, 0};    // unit, the chart's direction that becomes x
  Vec2d low{0, 0};     // input units, least coordinates after the tilt
  Vec2d scale{1, 1};   // texels per input unit along the tilted axes
  Vec2d offset{0, 0};  // texels, before the turn
  int quarters = 0;
  Vec2d footprint{0, 0};  // texels, width and height before the turn, whole numbers
  Vec2d corner{0, 0};     // texels, whole numbers
};

Vec2d ToPage(const Placement& placement, Vec2d p);

// One way to lay a chart down.
struct Pose {
  Shape shape;
  Placement placement;  // all but page and corner
};

// A chart at one density.
struct Candidate {
  std::vector<Pose> poses;
  int64_t cells = 0;  // of the first pose
};

struct Raster {
  double texels_per_unit = 1;
  int cell = 1;         // 4: no two charts may share a 4x4 block
  int gutter = 2;       // empty texels between charts
  int max_size = 1024;  // texels; longer charts are scaled down
  bool turn = true;     // quarter turns
  int tilts = 1;        // directions within a quarter turn for charts that are not rectangles
};

Candidate MakeCandidate(const PackItem& item, const Raster& raster);

}  // namespace bakewell::chart
