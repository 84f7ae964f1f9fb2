#pragma once

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
  // Number of set cells.
  int64_t Count() const {
    int64_t count = 0;
    for (const uint64_t word : words_) count += __builtin_popcountll(word);
    return count;
  }

 private:
  int width_ = 0, height_ = 0, stride_ = 0;
  std::vector<uint64_t> words_;
};

}  // namespace bakewell::chart
