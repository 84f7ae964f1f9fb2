#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/chart/pack/bitmap.h"

namespace bakewell::chart {

// Cells [begin, end) of one row.
struct Run {
  int row, begin, end;
};

// A shape to be placed: `test` must be free, `claim` is taken. Both as runs; claims may begin before 0 (a gutter).
struct Shape {
  int width = 0, height = 0;
  std::vector<Run> test;  // longest first
  std::vector<Run> claim;
};

Shape MakeShape(const Bitmap& test, const Bitmap& claim, int claim_origin);

struct Spot {
  int x, y;
};

// One page of cells, and a search for the lowest free place that looks at 64 columns at once: level k of a row has bit
// x set where any of the cells x .. x + 2^k - 1 is taken, so a run of any length is tested by two reads per word.
class Page {
 public:
  Page(int width, int height);

  // The free spot with the least y, then least x, at or below row `from` and with y + shape.height <= limit.
  std::optional<Spot> FindLowest(const Shape& shape, int from, int limit) const;
  void Place(const Shape& shape, Spot spot);
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  uint64_t* Row(int level, int y) { return words_.data() + (static_cast<size_t>(y) * levels_ + level) * stride_; }
  const uint64_t* Row(int level, int y) const {
    return words_.data() + (static_cast<size_t>(y) * levels_ + level) * stride_;
  }
  int FirstFreeColumn(const Shape& shape, int y) const;
  void RaiseLevels(int y);

  int width_, height_, levels_, stride_;
  std::vector<uint64_t> words_;
};

}  // namespace bakewell::chart
