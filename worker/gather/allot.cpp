#include "worker/gather/allot.h"

#include <algorithm>

namespace bakewell {
namespace {

constexpr double kAim = 0.95;  // of the sum that is allowed: rounds for the last crumbs cost more than they bring

}  // namespace

std::vector<bool> Allot(std::span<const Claim> claims, size_t texels) {
  std::vector<bool> granted(claims.size(), false);
  double sum = 0;
  std::vector<size_t> order;
  for (size_t i = 0; i < claims.size(); ++i) {
    // Beyond what one texel may have, what can get no more samples is nobody else's to make up for.
    sum += static_cast<double>(claims[i].open ? claims[i].error : std::min(claims[i].error, 1.0f));
    if (!claims[i].open || !(claims[i].error > 0)) continue;
    if (claims[i].error > kWorst * kWorst) {
      granted[i] = true;
    } else {
      order.push_back(i);
    }
  }
  const double allowed = static_cast<double>(texels);
  if (sum <= allowed) return granted;
  for (size_t i = 0; i < claims.size(); ++i) sum -= granted[i] ? 0.5 * static_cast<double>(claims[i].error) : 0;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    const float gain_a = claims[a].error * claims[b].cost, gain_b = claims[b].error * claims[a].cost;
    return gain_a != gain_b ? gain_a > gain_b : a < b;
  });
  for (const size_t i : order) {
    if (sum <= kAim * allowed) break;
    granted[i] = true;
    sum -= 0.5 * static_cast<double>(claims[i].error);
  }
  return granted;
}

std::vector<float> MeanOverNeighbours(const TexelMap& map, uint32_t begin, const std::vector<float>& values,
                                      const std::vector<bool>& valid) {
  std::vector<float> means(values.size(), 0);
  for (size_t i = 0; i < values.size(); ++i) {
    const Texel& texel = map.texels[begin + i];
    const PageSize page = map.pages[texel.page];
    float sum = 0;
    int count = 0;
    for (int y = std::max(0, texel.y - 1); y <= std::min(page.height - 1, texel.y + 1); ++y) {
      for (int x = std::max(0, texel.x - 1); x <= std::min(page.width - 1, texel.x + 1); ++x) {
        const size_t at = static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x);
        const int64_t j = int64_t{map.texel_at[texel.page][at]} - begin;
        if (j < 0 || j >= std::ssize(values) || !valid[static_cast<size_t>(j)]) continue;
        if (map.texels[begin + static_cast<size_t>(j)].chart != texel.chart) continue;
        sum += values[static_cast<size_t>(j)];
        ++count;
      }
    }
    if (count > 0) means[i] = sum / static_cast<float>(count);
  }
  return means;
}

}  // namespace bakewell
