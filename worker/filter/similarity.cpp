#include "worker/filter/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/base/check.h"

namespace bakewell {
namespace {

constexpr float kSlopeShare = 0.5f;  // of what the regression says: all of it is noisier, none of it is more biased
constexpr float kRising = 0.6f;      // of pairs, whose weight falls where they differ more
constexpr float kRidge = 1e-3f;      // squared texels; texels in one line give an answer too
constexpr float kTiny = 1e-36f;      // variance of what has none
constexpr size_t kMostRow = 64;

// Texels of a row side by side. The last of a row may lie beyond it, where they are of no use and do no harm.
constexpr size_t kLanes = 8;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using IntLanes = int32_t __attribute__((vector_size(kLanes * sizeof(int32_t))));
Lanes Load(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
IntLanes Load(const int32_t* from) {
  IntLanes lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}
void Store(Lanes lanes, float* to) { std::memcpy(to, &lanes, sizeof(lanes)); }
using Row = std::array<float, kMostRow + kLanes>;

// Between planes of weights: were they a power of two apart, all would meet in the same few lines of the cache.
constexpr size_t kPlaneGap = 2 * kLanes;

// Weights by distance, by WindowIndex.
const std::array<float, kWindow>& NearnessTable() {
  static const std::array<float, kWindow> table = [] {
    std::array<float, kWindow> t{};
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        t[WindowIndex(dx, dy)] = bakewell::Nearness(static_cast<float>(dx * dx + dy * dy));
      }
    }
    return t;
  }();
  return table;
}

float OffsetX(size_t index) { return static_cast<float>(index % kWindowSide) - kWindowRadius; }
float OffsetY(size_t index) { return static_cast<float>(index / kWindowSide) - kWindowRadius; }

}  // namespace

float SimilarTexels::Nearness(int dx, int dy) { return NearnessTable()[WindowIndex(dx, dy)]; }

SimilarTexels::SimilarTexels(int width, int height)
    : width_(width),
      height_(height),
      stride_(static_cast<size_t>(width) + 2 * kHalo),
      row_((static_cast<size_t>(width) + kLanes - 1) / kLanes * kLanes),
      plane_(row_ * static_cast<size_t>(height) + kPlaneGap),
      weights_(kWindow * plane_),
      means_(plane_) {
  BAKEWELL_CHECK(stride_ <= kMostRow);
  const size_t size = stride_ * (static_cast<size_t>(height) + 2 * kHalo) + 2 * kLanes;
  value_.resize(size), variance_.resize(size), pooled_.resize(size), part_.resize(size);
}

void SimilarTexels::Clear() {
  std::fill(value_.begin(), value_.end(), 0.0f);
  std::fill(variance_.begin(), variance_.end(), 0.0f);
  std::fill(part_.begin(), part_.end(), 0);
}

void SimilarTexels::Put(int x, int y, float value, float variance, uint16_t part) {
  const size_t at = Place(x, y);
  value_[at] = value;
  variance_[at] = variance;
  part_[at] = part;
}

// Eight blocks alone say little.
void SimilarTexels::PoolVariances() {
  for (int y = 1 - kHalo; y < height_ + kHalo - 1; ++y) {
    for (int x = 1 - kHalo; x < width_ + kHalo - 1; ++x) {
      const size_t at = Place(x, y);
      float sum = 0, count = 0;
      for (const size_t row : {at - stride_, at, at + stride_}) {
        for (const size_t other : {row - 1, row, row + 1}) {
          const bool same = part_[other] == part_[at];
          sum += same ? variance_[other] : 0;
          count += same ? 1.0f : 0.0f;
        }
      }
      pooled_[at] = sum / count;
    }
  }
}

void SimilarTexels::Compare(bool around) {
  PoolVariances();
  if (!around) std::fill(weights_.begin(), weights_.end(), 0.0f);
  std::fill_n(weights_.begin() + static_cast<std::ptrdiff_t>(WindowIndex(0, 0) * plane_), plane_, 1.0f);
  for (int dy = 0; dy <= kWindowRadius; ++dy) {
    for (int dx = dy == 0 ? 1 : -kWindowRadius; dx <= kWindowRadius; ++dx) CompareAt(dx, dy, around);
  }
}

void SimilarTexels::Differences(int y, int dx, int dy, int first, int end, float* squares, float* counts) const {
  Row square{}, count{};
  const size_t from = Place(first - 1, y), n = static_cast<size_t>(end - first) + 2;
  const size_t to = Place(first - 1 + dx, y + dy);
  for (size_t i = 0; i < n; i += kLanes) {
    const Lanes d = Load(&value_[from + i]) - Load(&value_[to + i]);
    const Lanes ratio = d * d / (Load(&pooled_[from + i]) + Load(&pooled_[to + i]) + kTiny);
    const IntLanes part = Load(&part_[from + i]);
    const IntLanes alike = (part == Load(&part_[to + i])) & (part != 0);
    Store(alike ? ratio : Lanes{}, &square[i]);
    Store(alike ? Lanes{} + 1 : Lanes{}, &count[i]);
  }
  for (size_t i = 0; i + 2 < n; i += kLanes) {
    Store(Load(&square[i]) + Load(&square[i + 1]) + Load(&square[i + 2]), &squares[i]);
    Store(Load(&count[i]) + Load(&count[i + 1]) + Load(&count[i + 2]), &counts[i]);
  }
}

void SimilarTexels::CompareAt(int dx, int dy, bool around) {
  // Pairs of which one is in the block, or both.
  const int first_x = around ? std::min(0, -dx) : std::max(0, -dx);
  const int end_x = around ? width_ + std::max(0, -dx) : width_ - std::max(0, dx);
  const int first_y = around ? -dy : 0, end_y = around ? height_ : height_ - dy;
  const float nearness = Nearness(dx, dy);
  std::array<Row, 3> squares, counts;
  Row weight;
  const auto n = static_cast<size_t>(std::max(0, end_x - first_x));
  const auto slot = [](int y) { return static_cast<size_t>((y + 3 * kHalo) % 3); };
  for (int below = first_y - 1; below <= end_y; ++below) {
    Differences(below, dx, dy, first_x, end_x, squares[slot(below)].data(), counts[slot(below)].data());
    const int y = below - 1;
    if (y < first_y) continue;
    const auto add = [&](const std::array<Row, 3>& rows, size_t i) {
      return Load(&rows[slot(y - 1)][i]) + Load(&rows[slot(y)][i]) + Load(&rows[slot(below)][i]);
    };
    const size_t from = Place(first_x, y), to = Place(first_x + dx, y + dy);
    for (size_t i = 0; i < n; i += kLanes) {
      const Lanes square = add(squares, i), count = add(counts, i);
      const Lanes like = Likeness(square / (count > 1 ? count : Lanes{} + 1));
      const IntLanes part = Load(&part_[from + i]);
      const IntLanes alike = (part == Load(&part_[to + i])) & (part != 0);
      Store(alike ? like * nearness : Lanes{}, &weight[i]);
    }
    const auto keep = [&](size_t index, int row, int shift) {
      if (row < 0 || row >= height_) return;
      const int begin = std::max(0, first_x + shift), end = std::min(width_, end_x + shift);
      if (begin >= end) return;
      std::copy_n(&weight[static_cast<size_t>(begin - shift - first_x)], end - begin,
                  &weights_[index * plane_ + static_cast<size_t>(row) * row_ + static_cast<size_t>(begin)]);
    };
    keep(WindowIndex(dx, dy), y, 0);
    keep(WindowIndex(-dx, -dy), y + dy, dx);
  }
}

void SimilarTexels::CutOff(int x, int y, const WindowSet& cut) {
  const size_t at = static_cast<size_t>(y) * row_ + static_cast<size_t>(x);
  for (size_t index = 0; index < kWindow; ++index) {
    if (cut[index]) weights_[index * plane_ + at] = 0;
  }
}

void SimilarTexels::Regress(float margin) {
  for (size_t at = 0; at < plane_; at += kLanes) {
    Lanes n = Load(&weights_[WindowIndex(0, 0) * plane_ + at]), x{}, y{}, xx{}, xy{}, yy{};
    // Opposite texels at a time.
    for (size_t index = 0; index < kWindow / 2; ++index) {
      const float dx = OffsetX(index), dy = OffsetY(index);
      const Lanes weight = Load(&weights_[index * plane_ + at]);
      const Lanes opposite = Load(&weights_[(kWindow - 1 - index) * plane_ + at]);
      const Lanes sum = weight + opposite, difference = weight - opposite;
      n += sum;
      x += difference * dx;
      y += difference * dy;
      xx += sum * (dx * dx);
      xy += sum * (dx * dy);
      yy += sum * (dy * dy);
    }
    // The plane through the window's mean, at its centre: by weights that are linear in dx and dy.
    const Lanes one = 1 / n, mean_x = x * one, mean_y = y * one;
    const Lanes cxx = xx * one - mean_x * mean_x + kRidge, cyy = yy * one - mean_y * mean_y + kRidge;
    const Lanes cxy = xy * one - mean_x * mean_y, scale = kSlopeShare / (cxx * cyy - cxy * cxy);
    const Lanes gx = scale * (cyy * mean_x - cxy * mean_y), gy = scale * (cxx * mean_y - cxy * mean_x);
    n = one * (1 + gx * mean_x + gy * mean_y);
    x = -one * gx;
    y = -one * gy;
    for (size_t index = 0; index < kWindow; ++index) {
      float* const weight = &weights_[index * plane_ + at];
      Store(Load(weight) * (n + x * OffsetX(index) + y * OffsetY(index)), weight);
    }
  }
  for (int row = 0; row < height_; ++row) Average(row, margin);
}

void SimilarTexels::Average(int y, float margin) {
  const size_t row = static_cast<size_t>(y) * row_;
  for (size_t begin = 0; begin < row_; begin += kLanes) {
    Lanes moved{}, square{}, variance{}, rise{}, rise_moved{};
    const size_t own_at = Place(static_cast<int>(begin), y);
    const Lanes own_value = Load(&value_[own_at]), own_variance = Load(&pooled_[own_at]);
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        const size_t at = Place(static_cast<int>(begin) + dx, y + dy);
        const Lanes weight = Load(&weights_[WindowIndex(dx, dy) * plane_ + row + begin]);
        const Lanes pooled = Load(&pooled_[at]), by = Load(&value_[at]) - own_value, weighted = weight * by;
        const Lanes change = weighted / (pooled + own_variance + kTiny);
        moved += weighted;
        square += weight * weight;
        variance += weight * weight * pooled;
        rise += change;
        rise_moved += change * by;
      }
    }
    const Lanes own = Load(&weights_[WindowIndex(0, 0) * plane_ + row + begin]);
    // The weights' own derivative, beside the texel's weight.
    constexpr float kPatch = 9;
    const Lanes follows = own + kRising * 2 / (kPatch * kTolerance * kTolerance) * (rise_moved - rise * moved);
    const Lanes chosen = follows * follows - own * own, all_variance = variance + chosen * own_variance;
    // Stein (1981): the mean square error is that of what the texel moved, less its variance, and twice what it
    // follows.
    const Lanes bias_square = moved * moved - (own_variance * (1 - 2 * follows) + all_variance) / margin;
    for (size_t i = 0; i < kLanes; ++i) {
      means_[row + begin + i] = {own_value[i] + moved[i], follows[i], square[i] + chosen[i], all_variance[i],
                                 bias_square[i]};
    }
  }
}

}  // namespace bakewell
