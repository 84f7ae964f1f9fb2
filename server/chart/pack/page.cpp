#include "server/chart/pack/page.h"

#include <algorithm>
#include <array>
#include <bit>

namespace bakewell::chart {
namespace {

constexpr int kMaxWords = 1024;  // pages of up to 65,536 columns

int LevelFor(int length) { return std::bit_width(static_cast<unsigned>(length)) - 1; }

std::vector<Run> RunsOf(const Bitmap& bitmap, int origin) {
  std::vector<Run> runs;
  bitmap.ForEachRun([&](int y, int begin, int end) { runs.push_back({y + origin, begin + origin, end + origin}); });
  return runs;
}

void FillRange(uint64_t* row, int begin, int end) {
  while (begin < end) {
    const int bit = begin % 64, count = std::min(64 - bit, end - begin);
    row[begin / 64] |= (count == 64 ? ~uint64_t{0} : (uint64_t{1} << count) - 1) << bit;
    begin += count;
  }
}

// blocked[i] |= row shifted down by `shift` bits.
void OrShifted(uint64_t* blocked, const uint64_t* row, int shift, int words) {
  const int skip = shift / 64, bit = shift % 64;
  row += skip;
  if (bit == 0) {
    for (int i = 0; i < words; ++i) blocked[i] |= row[i];
    return;
  }
  for (int i = 0; i < words; ++i) blocked[i] |= (row[i] >> bit) | (row[i + 1] << (64 - bit));
}

bool AllSet(const uint64_t* words, int count) {
  uint64_t all = ~uint64_t{0};
  for (int i = 0; i < count; ++i) all &= words[i];
  return all == ~uint64_t{0};
}

}  // namespace

Shape MakeShape(const Bitmap& test, const Bitmap& claim, int claim_origin) {
  Shape shape{test.width(), test.height(), RunsOf(test, 0), RunsOf(claim, claim_origin)};
  std::stable_sort(shape.test.begin(), shape.test.end(),
                   [](const Run& a, const Run& b) { return a.end - a.begin > b.end - b.begin; });
  return shape;
}

Page::Page(int width, int height)
    : width_(width), height_(height), levels_(LevelFor(width) + 1), stride_((width + 63) / 64 + 2) {
  words_.assign(static_cast<size_t>(stride_) * levels_ * height_, 0);
}

int Page::FirstFreeColumn(const Shape& shape, int y) const {
  const int columns = width_ - shape.width + 1, words = (columns + 63) / 64;
  std::array<uint64_t, kMaxWords> blocked;
  std::fill_n(blocked.begin(), words, 0);
  if (columns % 64 != 0) blocked[words - 1] = ~uint64_t{0} << (columns % 64);
  int since_check = 0;
  for (const Run& run : shape.test) {
    const int level = LevelFor(run.end - run.begin);
    const uint64_t* row = Row(level, y + run.row);
    OrShifted(blocked.data(), row, run.begin, words);
    OrShifted(blocked.data(), row, run.end - (1 << level), words);
    if (++since_check < 4) continue;
    since_check = 0;
    if (AllSet(blocked.data(), words)) return -1;
  }
  for (int i = 0; i < words; ++i)
    if (~blocked[i] != 0) return 64 * i + std::countr_one(blocked[i]);
  return -1;
}

std::optional<Spot> Page::FindLowest(const Shape& shape, int from, int limit) const {
  if (shape.width > width_) return std::nullopt;
  for (int y = std::max(from, 0); y + shape.height <= std::min(limit, height_); ++y)
    if (const int x = FirstFreeColumn(shape, y); x >= 0) return Spot{x, y};
  return std::nullopt;
}

void Page::RaiseLevels(int y) {
  for (int level = 1; level < levels_; ++level) {
    const uint64_t* below = Row(level - 1, y);
    uint64_t* row = Row(level, y);
    std::copy_n(below, stride_, row);
    const int shift = 1 << (level - 1), words = stride_ - 1 - shift / 64;
    if (words > 0) OrShifted(row, below, shift, words);
  }
}

void Page::Place(const Shape& shape, Spot spot) {
  int raised = -1;
  for (const Run& run : shape.claim) {
    const int y = spot.y + run.row;
    if (y < 0 || y >= height_) continue;
    if (raised >= 0 && raised != y) RaiseLevels(raised);
    raised = y;
    FillRange(Row(0, y), std::max(spot.x + run.begin, 0), std::min(spot.x + run.end, width_));
  }
  if (raised >= 0) RaiseLevels(raised);
}

}  // namespace bakewell::chart
