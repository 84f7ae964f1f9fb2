#include "worker/filter/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/check.h"

namespace bakewell {
namespace {

constexpr float kSlopeShare = 0.5f;  // of what the regression says: all of it is noisier, none of it is more biased
constexpr float kRising = 0.6f;      // of pairs, whose weight falls where they differ more
constexpr float kRidge = 1e-3f;      // squared texels; texels in one line give an answer too
constexpr float kTiny = 1e-36f;      // variance of what has none
constexpr size_t kMostRow = 64;

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
      row_(static_cast<size_t>(width)),
      plane_(row_ * static_cast<size_t>(height)),
      weights_(kWindow * plane_),
      means_(plane_) {
  BAKEWELL_CHECK(stride_ <= kMostRow);
  const size_t size = stride_ * (static_cast<size_t>(height) + 2 * kHalo);
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
  std::array<float, kMostRow> square, count;
  const size_t from = Place(first - 1, y), n = static_cast<size_t>(end - first) + 2;
  const size_t to = Place(first - 1 + dx, y + dy);
  const float *value = &value_[from], *other_value = &value_[to], *pooled = &pooled_[from],
              *other_pooled = &pooled_[to];
  const int32_t *part = &part_[from], *other_part = &part_[to];
  for (size_t i = 0; i < n; ++i) {
    const float d = value[i] - other_value[i];
    const float ratio = d * d / (pooled[i] + other_pooled[i] + kTiny);
    const bool alike = part[i] == other_part[i] && part[i] != 0;
    square[i] = alike ? ratio : 0.0f;
    count[i] = alike ? 1.0f : 0.0f;
  }
  for (size_t i = 0; i + 2 < n; ++i) {
    squares[i] = square[i] + square[i + 1] + square[i + 2];
    counts[i] = count[i] + count[i + 1] + count[i + 2];
  }
}

void SimilarTexels::CompareAt(int dx, int dy, bool around) {
  // Pairs of which one is in the block, or both.
  const int first_x = around ? std::min(0, -dx) : std::max(0, -dx);
  const int end_x = around ? width_ + std::max(0, -dx) : width_ - std::max(0, dx);
  const int first_y = around ? -dy : 0, end_y = around ? height_ : height_ - dy;
  const float nearness = Nearness(dx, dy);
  std::array<std::array<float, kMostRow>, 3> squares, counts;
  std::array<float, kMostRow> weight;
  const auto n = static_cast<size_t>(std::max(0, end_x - first_x));
  const auto slot = [](int y) { return static_cast<size_t>((y + 3 * kHalo) % 3); };
  for (int below = first_y - 1; below <= end_y; ++below) {
    Differences(below, dx, dy, first_x, end_x, squares[slot(below)].data(), counts[slot(below)].data());
    const int y = below - 1;
    if (y < first_y) continue;
    const auto add = [&](const std::array<std::array<float, kMostRow>, 3>& rows, size_t i) {
      return rows[slot(y - 1)][i] + rows[slot(y)][i] + rows[slot(below)][i];
    };
    const int32_t *part = &part_[Place(first_x, y)], *other_part = &part_[Place(first_x + dx, y + dy)];
    for (size_t i = 0; i < n; ++i) {
      const float square = add(squares, i), count = add(counts, i);
      const float like = Likeness(square / std::max(count, 1.0f));
      weight[i] = part[i] == other_part[i] && part[i] != 0 ? like * nearness : 0.0f;
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
  std::array<float, kMostRow> n, x, y, xx, xy, yy;
  for (size_t row = 0; row < plane_; row += row_) {
    const float* center = &weights_[WindowIndex(0, 0) * plane_ + row];
    for (auto* sum : {&x, &y, &xx, &xy, &yy}) sum->fill(0);
    std::copy_n(center, row_, n.begin());
    // Opposite texels at a time.
    for (size_t index = 0; index < kWindow / 2; ++index) {
      const float dx = OffsetX(index), dy = OffsetY(index);
      const float* weight = &weights_[index * plane_ + row];
      const float* opposite = &weights_[(kWindow - 1 - index) * plane_ + row];
      for (size_t i = 0; i < row_; ++i) {
        const float sum = weight[i] + opposite[i], difference = weight[i] - opposite[i];
        n[i] += sum;
        x[i] += difference * dx;
        y[i] += difference * dy;
        xx[i] += sum * (dx * dx);
        xy[i] += sum * (dx * dy);
        yy[i] += sum * (dy * dy);
      }
    }
    // The plane through the window's mean, at its centre: by weights that are linear in dx and dy.
    for (size_t i = 0; i < row_; ++i) {
      const float one = 1 / n[i], mean_x = x[i] * one, mean_y = y[i] * one;
      const float cxx = xx[i] * one - mean_x * mean_x + kRidge, cyy = yy[i] * one - mean_y * mean_y + kRidge;
      const float cxy = xy[i] * one - mean_x * mean_y, scale = kSlopeShare / (cxx * cyy - cxy * cxy);
      const float gx = scale * (cyy * mean_x - cxy * mean_y), gy = scale * (cxx * mean_y - cxy * mean_x);
      n[i] = one * (1 + gx * mean_x + gy * mean_y);
      x[i] = -one * gx;
      y[i] = -one * gy;
    }
    for (size_t index = 0; index < kWindow; ++index) {
      const float dx = OffsetX(index), dy = OffsetY(index);
      float* weight = &weights_[index * plane_ + row];
      for (size_t i = 0; i < row_; ++i) weight[i] *= n[i] + x[i] * dx + y[i] * dy;
    }
  }
  for (int row = 0; row < height_; ++row) Average(row, margin);
}

void SimilarTexels::Average(int y, float margin) {
  std::array<float, kMostRow> moved{}, square{}, variance{}, rise{}, rise_moved{};
  const size_t row = static_cast<size_t>(y) * row_;
  const float *own_value = &value_[Place(0, y)], *own_variance = &pooled_[Place(0, y)];
  for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
    for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
      const float* weights = &weights_[WindowIndex(dx, dy) * plane_ + row];
      const float *value = &value_[Place(dx, y + dy)], *pooled = &pooled_[Place(dx, y + dy)];
      for (size_t i = 0; i < row_; ++i) {
        const float weight = weights[i], by = value[i] - own_value[i], weighted = weight * by;
        const float change = weighted / (pooled[i] + own_variance[i] + kTiny);
        moved[i] += weighted;
        square[i] += weight * weight;
        variance[i] += weight * weight * pooled[i];
        rise[i] += change;
        rise_moved[i] += change * by;
      }
    }
  }
  const float* own = &weights_[WindowIndex(0, 0) * plane_ + row];
  for (size_t i = 0; i < row_; ++i) {
    Mean& mean = means_[row + i];
    mean.value = own_value[i] + moved[i];
    // The weights' own derivative, beside the texel's weight.
    constexpr float kPatch = 9;
    mean.follows = own[i] + kRising * 2 / (kPatch * kTolerance * kTolerance) * (rise_moved[i] - rise[i] * moved[i]);
    const float chosen = mean.follows * mean.follows - own[i] * own[i];
    mean.square = square[i] + chosen;
    mean.variance = variance[i] + chosen * own_variance[i];
    // Stein (1981): the mean square error is that of what the texel moved, less its variance, and twice what it
    // follows.
    mean.bias_square = moved[i] * moved[i] - (own_variance[i] * (1 - 2 * mean.follows) + mean.variance) / margin;
  }
}

}  // namespace bakewell
