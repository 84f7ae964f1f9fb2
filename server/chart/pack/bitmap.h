#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bakewell::chart {

// width x height cells, one bit each; row y is `stride` words, bit x % 64 of word x / 64. Bits past the width are 0.
class Bitmap {
 public:
  Bitmap() = default;
  Bitmap(int width, int height)
      : width_(width), height_(height), stride_((width + 63) / 64), words_(static_cast<size_t>(stride_) * height, 0) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool Get(int x, int y) const { return (Row(y)[x / 64] >> (x % 64)) & 1; }
  void Set(int x, int y) { Row(y)[x / 64] |= uint64_t{1} << (x % 64); }
  // Sets [begin, end) of a row, clipped to the width.
  void SetRange(int y, int begin, int end) {
    if (begin < 0) begin = 0;
    if (end > width_) end = width_;
    while (begin < end) {
      const int bit = begin % 64, count = end - begin < 64 - bit ? end - begin : 64 - bit;
      Row(y)[begin / 64] |= (count == 64 ? ~uint64_t{0} : ((uint64_t{1} << count) - 1)) << bit;
      begin += count;
    }
  }
  uint64_t* Row(int y) { return words_.data() + static_cast<size_t>(y) * stride_; }
  const uint64_t* Row(int y) const { return words_.data() + static_cast<size_t>(y) * stride_; }
  int stride() const { return stride_; }
  // Calls visit(y, begin, end) for every longest run of set cells, row by row.
  template <typename Visit>
  void ForEachRun(const Visit& visit) const {
    for (int y = 0; y < height_; ++y)
      for (int x = Next(y, 0, true); x < width_;) {
        const int end = Next(y, x, false);
        visit(y, x, end);
        x = Next(y, end, true);
      }
  }
  // Number of set cells.
  int64_t Count() const {
    int64_t count = 0;
    for (const uint64_t word : words_) count += std::popcount(word);
    return count;
  }

 private:
  // The first cell at or after x that is (not) set; the width if there is none.
  int Next(int y, int x, bool set) const {
    for (int w = x / 64; w < stride_; ++w) {
      uint64_t word = set ? Row(y)[w] : ~Row(y)[w];
      if (w == x / 64) word &= ~uint64_t{0} << (x % 64);
      if (word != 0) return std::min(width_, 64 * w + std::countr_zero(word));
    }
    return width_;
  }

  int width_ = 0, height_ = 0, stride_ = 0;
  std::vector<uint64_t> words_;
};

}  // namespace bakewell::chart
