#include "worker/finish/filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <map>

#include "worker/filter/window.h"

namespace bakewell {
namespace {

class PageFilter {
 public:
  PageFilter(const TexelMap& map, int page, std::span<TexelLight> lights)
      : map_(map), page_(page), lights_(lights), grid_(map.pages[page].width, map.pages[page].height) {
    for (const int32_t at : map.texel_at[page]) {
      if (at >= 0) texels_.push_back(static_cast<uint32_t>(at));
    }
  }

  void Run(FilterCounters& counters) {
    for (const uint32_t i : texels_) Put(i);
    grid_.MeasureRoom();
    std::vector<float> pooled(texels_.size());
    ForEach([&](size_t k, const Texel& texel) { pooled[k] = grid_.NoiseVariance(texel.x, texel.y); });
    ForEach([&](size_t k, const Texel& texel) { grid_.At(texel.x, texel.y).variance = pooled[k]; });
    ForEach([&](size_t, const Texel& texel) {
      if (grid_.At(texel.x, texel.y).known) grid_.Choose(texel.x, texel.y);
    });
    std::vector<LightPart> smooth(texels_.size());
    std::vector<uint8_t> changed(texels_.size(), 0);
    ForEach([&](size_t k, const Texel& texel) { changed[k] = Smooth(texel, smooth[k]) ? 1 : 0; });
    KeepFlux(changed, smooth);
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (changed[k] == 0) continue;
      Replace(lights_[texels_[k]], smooth[k]);
      ++counters.filtered;
    }
  }

 private:
  template <typename Visit>
  void ForEach(Visit visit) {
    tbb::parallel_for(size_t{0}, texels_.size(), [&](size_t k) { visit(k, map_.texels[texels_[k]]); });
  }

  const TexelLight* LightAt(int x, int y) const {
    const size_t at = static_cast<size_t>(y) * static_cast<size_t>(grid_.width()) + static_cast<size_t>(x);
    const int32_t i = map_.texel_at[page_][at];
    return i < 0 ? nullptr : &lights_[i];
  }

  void Put(uint32_t i) {
    const Texel& texel = map_.texels[i];
    const TexelLight& light = lights_[i];
    if (!light.valid) return;
    SmoothCell& cell = grid_.At(texel.x, texel.y);
    cell.known = true;
    cell.value = Luminance(light.indirect.irradiance);
    cell.variance = Luminance(light.indirect.variance);
    for (int k = 0; k < 4; ++k) {
      if (!(light.open >> k & 1)) continue;
      const TexelLight* other = LightAt(texel.x + kNeighbours[k][0], texel.y + kNeighbours[k][1]);
      if (other != nullptr && other->valid) grid_.Connect(texel.x, texel.y, k);
    }
  }

  // A part's numbers side by side, of which the last three are its variance.
  static constexpr size_t kNumbers = 33, kVariance = 30, kWide = 32;
  using Numbers = std::array<float, kNumbers>;
  static_assert(sizeof(LightPart) == sizeof(Numbers) && offsetof(LightPart, variance) == kVariance * sizeof(float));

  bool Smooth(const Texel& texel, LightPart& result) const {
    if (!grid_.At(texel.x, texel.y).known) return false;
    const SmoothGrid::Window window = grid_.WindowOf(texel.x, texel.y, grid_.Agree(texel.x, texel.y));
    const int radius = window.radius;
    if (radius == 0) return false;
    Numbers sum{};
    std::array<float, 3> variance{};
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        const float weight = window.At(dx, dy);
        if (weight == 0) continue;
        const float* const light = &LightAt(texel.x + dx, texel.y + dy)->indirect.irradiance.x;
        for (size_t k = 0; k < kWide; ++k) sum[k] += light[k] * weight;  // four registers; the end is put right below
        for (size_t k = 0; k < 3; ++k) variance[k] += light[kVariance + k] * (weight * weight);
      }
    }
    std::copy(variance.begin(), variance.end(), sum.begin() + kVariance);
    result = std::bit_cast<LightPart>(sum);
    return std::min({result.irradiance.x, result.irradiance.y, result.irradiance.z}) >= 0;
  }

  // Windows that avoid a bright stray lose its light: each chart's sum is brought back to what it was.
  void KeepFlux(const std::vector<uint8_t>& changed, std::vector<LightPart>& smooth) const {
    struct Sum {
      double before = 0, after = 0;
    };
    std::map<int32_t, Sum> charts;
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (changed[k] == 0) continue;
      Sum& sum = charts[map_.texels[texels_[k]].chart];
      sum.before += static_cast<double>(Luminance(lights_[texels_[k]].indirect.irradiance));
      sum.after += static_cast<double>(Luminance(smooth[k].irradiance));
    }
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (changed[k] == 0) continue;
      const Sum& sum = charts[map_.texels[texels_[k]].chart];
      if (!(sum.after > 0)) continue;
      const float scale = static_cast<float>(sum.before / sum.after);
      smooth[k].irradiance = smooth[k].irradiance * scale;
      for (Rgb& lambda : smooth[k].sh.lambda) lambda = lambda * scale;
      smooth[k].variance = smooth[k].variance * (scale * scale);
    }
  }

  static void Replace(TexelLight& light, const LightPart& smooth) {
    const LightPart before = light.indirect;
    light.indirect = smooth;
    light.irradiance += smooth.irradiance - before.irradiance;
    for (size_t c = 0; c < kShCoefficients; ++c) light.sh.lambda[c] += smooth.sh.lambda[c] - before.sh.lambda[c];
    light.variance += smooth.variance - before.variance;
  }

  const TexelMap& map_;
  const int page_;
  const std::span<TexelLight> lights_;
  SmoothGrid grid_;
  std::vector<uint32_t> texels_;
};

}  // namespace

void FilterPage(const TexelMap& map, int page, std::span<TexelLight> lights, FilterCounters& counters) {
  PageFilter(map, page, lights).Run(counters);
}

}  // namespace bakewell
