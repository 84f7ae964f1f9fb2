#include "worker/sample/distribution.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include "core/base/check.h"

namespace bakewell {

Distribution1D::Distribution1D(std::span<const float> weights) : size_(static_cast<int>(weights.size())) {
  BAKEWELL_CHECK(!weights.empty());
  thread_local std::vector<double> sums;  // before each
  sums.resize(weights.size());
  for (size_t i = 0; i < weights.size(); ++i) {
    sums[i] = total_;
    total_ += static_cast<double>(weights[i]);
  }
  size_t count = weights.size();
  if (total_ > 0) {
    while (!(weights[count - 1] > 0)) --count;
  } else {
    std::iota(sums.begin(), sums.end(), 0.0);
  }
  const auto has_weight = [&](size_t i) { return weights[i] > 0 || !(total_ > 0) ? 1 : 0; };
  const double scale = static_cast<double>(kOne) / (total_ > 0 ? total_ : static_cast<double>(count));
  cdf_.resize(count);
  int64_t begin = 0;
  for (size_t i = 1; i < count; ++i) {
    begin = std::max(begin + has_weight(i - 1), static_cast<int64_t>(sums[i] * scale + 0.5));
    cdf_[i] = static_cast<uint32_t>(std::min<int64_t>(begin, kOne - 1));
  }
  // Room for the last ones.
  for (size_t i = count - 1; i-- > 0;) {
    const uint32_t most = cdf_[i + 1] - static_cast<uint32_t>(has_weight(i));
    if (cdf_[i] <= most && cdf_[i] < kOne - 1) break;
    cdf_[i] = std::min(cdf_[i], most);
  }
  constexpr size_t kFew = 16, kPerStart = 8;
  if (count <= kFew || count > std::numeric_limits<uint16_t>::max()) return;
  begin_.resize(std::bit_floor(count / kPerStart));  // u times a power of two is exact
  uint16_t cell = 0;
  for (size_t i = 0; i < begin_.size(); ++i) {
    while (cell + size_t{1} < count && cdf_[cell + 1] <= i * (kOne / begin_.size())) ++cell;
    begin_[i] = cell;
  }
}

Distribution1D::Sample Distribution1D::Draw(float u) const {
  const auto at = static_cast<uint64_t>(static_cast<double>(u) * static_cast<double>(kOne));
  size_t index = 0;
  if (begin_.empty()) {
    index = static_cast<size_t>(std::upper_bound(cdf_.begin() + 1, cdf_.end(), at) - cdf_.begin()) - 1;
  } else {
    index = begin_[static_cast<size_t>(at * begin_.size() / kOne)];
    while (index + 1 < cdf_.size() && cdf_[index + 1] <= at) ++index;
  }
  const auto width = static_cast<double>(Width(index));
  const double remainder = static_cast<double>(at - cdf_[index]) / width;
  return {static_cast<int>(index), Probability(static_cast<int>(index)),
          std::clamp(static_cast<float>(remainder), 0.0f, 0x1.fffffep-1f)};
}

Distribution2D::Distribution2D(int width, int height, std::span<const float> weights) : width_(width), height_(height) {
  BAKEWELL_CHECK_OP(weights.size(), ==, static_cast<size_t>(width) * static_cast<size_t>(height));
  constexpr double kMostTotal = std::numeric_limits<float>::max();
  std::vector<float> row_totals;
  rows_.reserve(static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    rows_.emplace_back(
        weights.subspan(static_cast<size_t>(y) * static_cast<size_t>(width), static_cast<size_t>(width)));
    row_totals.push_back(static_cast<float>(std::min(rows_.back().total(), kMostTotal)));
  }
  marginal_ = Distribution1D(row_totals);
}

Distribution2D::Sample Distribution2D::Draw(Vec2f u) const {
  const auto row = marginal_.Draw(u.y);
  const auto column = rows_[row.index].Draw(u.x);
  return {column.index,
          row.index,
          {(static_cast<float>(column.index) + column.remainder) / static_cast<float>(width_),
           (static_cast<float>(row.index) + row.remainder) / static_cast<float>(height_)},
          Pdf(column.index, row.index)};
}

float Distribution2D::Pdf(int x, int y) const {
  return marginal_.Probability(y) * rows_[y].Probability(x) * static_cast<float>(width_) * static_cast<float>(height_);
}

}  // namespace bakewell
