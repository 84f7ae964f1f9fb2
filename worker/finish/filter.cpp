#include "worker/finish/filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include "worker/filter/window.h"
#include "worker/gather/noise.h"

namespace bakewell {
namespace {

class PageFilter {
 public:
  PageFilter(const TexelMap& map, int page, std::span<TexelLight> lights)
      : map_(map), page_(page), lights_(lights), grid_(map.pages[page].width, map.pages[page].height, Signal::kDirect) {
    for (const int32_t at : map.texel_at[page]) {
      if (at < 0) continue;
      texels_.push_back(static_cast<uint32_t>(at));
      Connect(texels_.back());
    }
    grid_.MeasureRoom();
  }

  // Returns what is to be added to FilterCounters::bias_square.
  double Run(Signal signal, std::vector<bool>& filtered) {
    signal_ = signal;
    grid_ = SmoothGrid(std::move(grid_), signal);
    for (const uint32_t i : texels_) Put(i);
    std::vector<SmoothGrid::Calm> calm(texels_.size());
    ForEach([&](size_t k, const Texel& texel) { calm[k] = grid_.Calmed(texel.x, texel.y); });
    ForEach([&](size_t k, const Texel& texel) { grid_.Take(texel.x, texel.y, calm[k]); });
    ForEach([&](size_t, const Texel& texel) {
      SmoothCell& cell = grid_.At(texel.x, texel.y);
      if (cell.known) cell.radius = grid_.Choose(texel.x, texel.y);
    });
    std::vector<LightPart> smooth(texels_.size());
    std::vector<uint8_t> changed(texels_.size(), 0);
    std::vector<double> bias_square(texels_.size(), 0);
    ForEach([&](size_t k, const Texel& texel) { changed[k] = Smooth(texel, smooth[k], bias_square[k]) ? 1 : 0; });
    KeepFlux(changed, smooth);
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (changed[k] == 0) continue;
      Replace(lights_[texels_[k]], smooth[k]);
      filtered[texels_[k]] = true;
    }
    return std::accumulate(bias_square.begin(), bias_square.end(), 0.0);
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

  // Luminance of the part that is filtered.
  float ValueOf(const TexelLight& light) const {
    const float indirect = Luminance(light.indirect.irradiance);
    return signal_ == Signal::kIndirect ? indirect : Luminance(light.irradiance) - indirect;
  }

  Rgb VarianceOf(const TexelLight& light) const {
    return signal_ == Signal::kIndirect ? light.indirect.variance : light.direct_variance;
  }

  void Put(uint32_t i) {
    const TexelLight& light = lights_[i];
    if (!light.valid) return;
    SmoothCell& cell = grid_.At(map_.texels[i].x, map_.texels[i].y);
    cell.known = true;
    cell.value = ValueOf(light);
    cell.variance = Luminance(VarianceOf(light));
  }

  void Connect(uint32_t i) {
    const Texel& texel = map_.texels[i];
    const TexelLight& light = lights_[i];
    if (!light.valid) return;
    for (int k = 0; k < 4; ++k) {
      if (!(light.open >> k & 1)) continue;
      const TexelLight* other = LightAt(texel.x + kNeighbours[k][0], texel.y + kNeighbours[k][1]);
      if (other != nullptr && other->valid) grid_.Connect(texel.x, texel.y, k);
    }
  }

  // The numbers of a part, or of the whole, side by side; the last three are its variance.
  static constexpr size_t kNumbers = 33, kVariance = 30, kWide = 32;
  using Numbers = std::array<float, kNumbers>;
  static_assert(sizeof(LightPart) == sizeof(Numbers) && offsetof(LightPart, variance) == kVariance * sizeof(float) &&
                offsetof(TexelLight, variance) == kVariance * sizeof(float));

  // Four registers' worth; what is wrong at the end is put right by the caller.
  static void AddWeighted(const float* numbers, float weight, Numbers& sum) {
    for (size_t k = 0; k < kWide; ++k) sum[k] += numbers[k] * weight;
  }

  bool Smooth(const Texel& texel, LightPart& result, double& bias_square) const {
    if (!grid_.At(texel.x, texel.y).known) return false;
    const float agreed = grid_.Agree(texel.x, texel.y);
    if (agreed == 0) return false;
    const SmoothGrid::Window window = grid_.WindowOf(texel.x, texel.y, agreed);
    const int radius = window.radius;
    if (radius == 0) return false;
    Numbers sum{};
    Rgb variance;
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        const float weight = window.At(dx, dy);
        if (weight == 0) continue;
        const TexelLight& light = *LightAt(texel.x + dx, texel.y + dy);
        if (signal_ == Signal::kDirect) AddWeighted(&light.irradiance.x, weight, sum);
        AddWeighted(&light.indirect.irradiance.x, signal_ == Signal::kDirect ? -weight : weight, sum);
        variance += VarianceOf(light) * (weight * weight);
      }
    }
    result = std::bit_cast<LightPart>(sum);
    result.variance = variance;
    if (std::min({result.irradiance.x, result.irradiance.y, result.irradiance.z}) < 0) return false;
    // Without bias the texel would move by as much as its noise and the window's, which share its own weight.
    const TexelLight& own = *LightAt(texel.x, texel.y);
    const float moved = Luminance(result.irradiance) - ValueOf(own);
    const float noise = Luminance(VarianceOf(own)) * (1 - 2 * window.At(0, 0)) + Luminance(variance);
    bias_square =
        static_cast<double>(moved) * static_cast<double>(moved) - static_cast<double>(noise) / SetNoise::kMargin;
    return true;
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
      sum.before += static_cast<double>(ValueOf(lights_[texels_[k]]));
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

  void Replace(TexelLight& light, const LightPart& smooth) const {
    light.variance += smooth.variance - VarianceOf(light);
    if (signal_ == Signal::kDirect) {
      light.irradiance = smooth.irradiance + light.indirect.irradiance;
      for (size_t c = 0; c < kShCoefficients; ++c) {
        light.sh.lambda[c] = smooth.sh.lambda[c] + light.indirect.sh.lambda[c];
      }
      light.direct_variance = smooth.variance;
      return;
    }
    const LightPart before = std::exchange(light.indirect, smooth);
    light.irradiance += smooth.irradiance - before.irradiance;
    for (size_t c = 0; c < kShCoefficients; ++c) light.sh.lambda[c] += smooth.sh.lambda[c] - before.sh.lambda[c];
  }

  const TexelMap& map_;
  const int page_;
  Signal signal_ = Signal::kDirect;
  const std::span<TexelLight> lights_;
  SmoothGrid grid_;
  std::vector<uint32_t> texels_;
};

}  // namespace

void FilterPage(const TexelMap& map, int page, std::span<TexelLight> lights, FilterCounters& counters) {
  std::vector<bool> filtered(lights.size(), false);
  const bool noisy = std::any_of(lights.begin(), lights.end(),
                                 [](const TexelLight& light) { return MaxComponent(light.direct_variance) > 0; });
  PageFilter filter(map, page, lights);
  if (noisy) counters.bias_square += filter.Run(Signal::kDirect, filtered);
  counters.bias_square += filter.Run(Signal::kIndirect, filtered);
  counters.filtered += std::count(filtered.begin(), filtered.end(), true);
}

}  // namespace bakewell
