#include "worker/sample/distribution.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/base/check.h"

namespace bakewell {

Distribution1D::Distribution1D(std::span<const float> weights) : cdf_(weights.size() + 1) {
  BAKEWELL_CHECK(!weights.empty());
  for (size_t i = 0; i < weights.size(); ++i) cdf_[i + 1] = cdf_[i] + static_cast<double>(weights[i]);
  total_ = cdf_.back();
  for (size_t i = 1; i < cdf_.size(); ++i) {
    cdf_[i] = total_ > 0 ? cdf_[i] / total_ : static_cast<double>(i) / static_cast<double>(weights.size());
  }
  cdf_.back() = 1;
  constexpr size_t kFew = 16, kPerStart = 8;
  if (weights.size() <= kFew || weights.size() > std::numeric_limits<uint16_t>::max()) return;
  begin_.resize(std::bit_floor(weights.size() / kPerStart));  // u times a power of two is exact
  uint16_t cell = 0;
  for (size_t i = 0; i < begin_.size(); ++i) {
    while (cdf_[cell + 1] <= static_cast<double>(i) / static_cast<double>(begin_.size())) ++cell;
    begin_[i] = cell;
  }
}

Distribution1D::Sample Distribution1D::Draw(float u) const {
  int index = 0;
  if (begin_.empty()) {
    const auto above = std::upper_bound(cdf_.begin(), cdf_.end() - 1, static_cast<double>(u));
    index = std::max(0, static_cast<int>(above - cdf_.begin()) - 1);
  } else {
    index = begin_[static_cast<size_t>(u * static_cast<float>(begin_.size()))];
  }
  while (index + 1 < size() && cdf_[index + 1] <= static_cast<double>(u)) ++index;
  // Cells whose probability is zero, or so small that single precision has no number for it, are not drawn.
  while (index > 0 && Probability(index) <= 0) --index;
  while (index + 1 < size() && Probability(index) <= 0) ++index;
  const double probability = cdf_[index + 1] - cdf_[index];
  const double remainder = probability > 0 ? (static_cast<double>(u) - cdf_[index]) / probability : 0.0;
  return {index, static_cast<float>(probability), std::clamp(static_cast<float>(remainder), 0.0f, 0x1.fffffep-1f)};
}

Distribution2D::Distribution2D(int width, int height, std::span<const float> weights) : width_(width), height_(height) {
  BAKEWELL_CHECK_OP(weights.size(), ==, static_cast<size_t>(width) * static_cast<size_t>(height));
  std::vector<float> row_totals;
  rows_.reserve(static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    rows_.emplace_back(
        weights.subspan(static_cast<size_t>(y) * static_cast<size_t>(width), static_cast<size_t>(width)));
    row_totals.push_back(static_cast<float>(rows_.back().total()));
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
