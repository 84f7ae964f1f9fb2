#include "server/chart/pack/footprint.h"

#include <algorithm>
#include <cmath>

namespace bakewell::chart {
namespace {

// How deep an outline must reach into a texel to touch it.
constexpr double kTouch = 1.0 / 128;

int FirstTouched(double low) { return static_cast<int>(std::floor(low + kTouch)); }
int EndTouched(double high) { return static_cast<int>(std::ceil(high - kTouch)); }

void TraceSegment(Bitmap& bitmap, Vec2d a, Vec2d b) {
  if (a.y > b.y) std::swap(a, b);
  const int y_end = std::min(EndTouched(b.y), bitmap.height());
  const double slope = b.y > a.y ? (b.x - a.x) / (b.y - a.y) : 0;
  for (int y = std::max(FirstTouched(a.y), 0); y < y_end; ++y) {
    // The part of the segment inside this row.
    const double y0 = std::max(a.y, y + kTouch), y1 = std::min(b.y, y + 1 - kTouch);
    double x0 = a.y < y + kTouch ? a.x + (y0 - a.y) * slope : a.x;
    double x1 = b.y > y + 1 - kTouch ? a.x + (y1 - a.y) * slope : b.x;
    if (x0 > x1) std::swap(x0, x1);
    bitmap.SetRange(y, FirstTouched(x0), std::max(EndTouched(x1), FirstTouched(x0)));
  }
}

struct Crossing {
  int y;
  double x;
};

// Where the outline crosses the rows' centre lines, sorted by row and column.
std::vector<Crossing> CentreCrossings(std::span<const Segment2> outline) {
  std::vector<Crossing> crossings;
  for (const auto& [a, b] : outline) {
    const Vec2d low = a.y < b.y ? a : b, high = a.y < b.y ? b : a;
    const int begin = static_cast<int>(std::ceil(low.y - 0.5)), end = static_cast<int>(std::ceil(high.y - 0.5));
    for (int y = begin; y < end; ++y)
      crossings.push_back({y, low.x + (y + 0.5 - low.y) * ((high.x - low.x) / (high.y - low.y))});
  }
  std::sort(crossings.begin(), crossings.end(),
            [](const Crossing& a, const Crossing& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; });
  return crossings;
}

void FillInside(Bitmap& bitmap, std::span<const Segment2> outline) {
  const std::vector<Crossing> crossings = CentreCrossings(outline);
  for (size_t i = 0; i + 1 < crossings.size(); i += 2)
    bitmap.SetRange(crossings[i].y, static_cast<int>(std::ceil(crossings[i].x - 0.5)),
                    static_cast<int>(std::ceil(crossings[i + 1].x - 0.5)));
}

}  // namespace

Bitmap RasterizeCover(std::span<const Segment2> outline) {
  Vec2d high{0, 0};
  for (const auto& [a, b] : outline) high = {std::max({high.x, a.x, b.x}), std::max({high.y, a.y, b.y})};
  Bitmap bitmap(std::max(EndTouched(high.x), 1), std::max(EndTouched(high.y), 1));
  for (const auto& [a, b] : outline) TraceSegment(bitmap, a, b);
  FillInside(bitmap, outline);
  if (bitmap.Count() == 0) bitmap.Set(0, 0);
  return bitmap;
}

Bitmap Dilate(const Bitmap& bitmap, int radius) {
  Bitmap wide(bitmap.width() + 2 * radius, bitmap.height());
  bitmap.ForEachRun([&](int y, int begin, int end) { wide.SetRange(y, begin, end + 2 * radius); });
  Bitmap result(wide.width(), bitmap.height() + 2 * radius);
  for (int y = 0; y < result.height(); ++y)
    for (int from = std::max(0, y - 2 * radius); from <= std::min(y, wide.height() - 1); ++from)
      for (int w = 0; w < wide.stride(); ++w) result.Row(y)[w] |= wide.Row(from)[w];
  return result;
}

Bitmap ToBlocks(const Bitmap& bitmap, int size, int shift_x, int shift_y) {
  Bitmap blocks((bitmap.width() + shift_x + size - 1) / size, (bitmap.height() + shift_y + size - 1) / size);
  bitmap.ForEachRun([&](int y, int begin, int end) {
    blocks.SetRange((y + shift_y) / size, (begin + shift_x) / size, (end - 1 + shift_x) / size + 1);
  });
  return blocks;
}

Bitmap TurnQuarter(const Bitmap& bitmap) {
  Bitmap turned(bitmap.height(), bitmap.width());
  bitmap.ForEachRun([&](int y, int begin, int end) {
    for (int x = begin; x < end; ++x) turned.Set(bitmap.height() - 1 - y, x);
  });
  return turned;
}

}  // namespace bakewell::chart
