#include "worker/finish/filter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <map>
#include <numeric>
#include <utility>

#include "worker/filter/similarity.h"
#include "worker/gather/noise.h"

namespace bakewell {
namespace {

enum class Signal : uint8_t { kIndirect, kDirect };

constexpr int kBlock = 32;  // texels a side that are weighed at a time
constexpr float kMargin = static_cast<float>(SetNoise::kMargin);
constexpr float kOfOne = 0.4f;       // one difference varies more than a patch of them
constexpr double kPageSays = 8;      // texels: as many of a chart's is the page's mean worth
constexpr double kPhotonMargin = 2;  // of what is left of photons' noise, so that what is reported is safe
constexpr float kMuchNoisier = 2;    // of two variances at a seam: the noisier counts for less

class PageFilter {
 public:
  PageFilter(const TexelMap& map, int page, std::span<TexelLight> lights)
      : map_(map), page_(page), lights_(lights), connections_(map.pages[page].width, map.pages[page].height) {
    for (const int32_t at : map.texel_at[page]) {
      if (at >= 0) Connect(static_cast<uint32_t>(at));
    }
    connections_.Finish();
    for (int top = 0; top < connections_.height(); top += kBlock) {
      for (int left = 0; left < connections_.width(); left += kBlock) AddBlock(left, top);
    }
    tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) { Cut(blocks_[b]); });
  }

  // Returns what is to be added to FilterCounters::bias_square.
  double Run(Signal signal, std::vector<bool>& filtered) {
    signal_ = signal;
    std::vector<Smoothed> smooth(texels_.size());
    tbb::parallel_for(size_t{0}, blocks_.size(), [&](size_t b) {
      const Block& block = blocks_[b];
      thread_local Workspace work;
      if (!Weigh(block, work)) return;
      for (size_t k = block.begin; k < block.end; ++k) {
        const Texel& texel = map_.texels[texels_[k]];
        smooth[k] = Smooth(texel.x - block.left, texel.y - block.top, work);
      }
    });
    Settle(smooth);
    double bias_square = 0;
    for (size_t k = 0; k < texels_.size(); ++k) {
      bias_square += smooth[k].bias_square;
      if (!smooth[k].changed) continue;
      Replace(lights_[texels_[k]], smooth[k].light);
      filtered[texels_[k]] = true;
    }
    return bias_square;
  }

  // Along the seams, after Run of the same signal. Returns what is to be added to FilterCounters::bias_square.
  double RunAlong(std::span<const Seam> seams, Signal signal, std::vector<bool>& filtered) {
    signal_ = signal;
    std::vector<std::span<const Seam>> of_texel;
    for (size_t begin = 0, end = 0; begin < seams.size(); begin = end) {
      while (end < seams.size() && seams[end].texel == seams[begin].texel) ++end;
      of_texel.push_back(seams.subspan(begin, end - begin));
    }
    std::vector<LightPart> joined(of_texel.size());
    std::vector<uint8_t> changed(of_texel.size(), 0);
    std::vector<double> bias_square(of_texel.size(), 0);
    tbb::parallel_for(size_t{0}, of_texel.size(),
                      [&](size_t k) { changed[k] = Join(of_texel[k], joined[k], bias_square[k]) ? 1 : 0; });
    for (size_t k = 0; k < of_texel.size(); ++k) {
      if (changed[k] == 0) continue;
      Replace(lights_[of_texel[k].front().texel], joined[k]);
      filtered[of_texel[k].front().texel] = true;
    }
    return std::accumulate(bias_square.begin(), bias_square.end(), 0.0);
  }

 private:
  struct Block {
    int left = 0, top = 0;
    size_t begin = 0, end = 0;  // of texels_
    struct Cut {
      int x = 0, y = 0;  // in the block
      WindowSet texels;
    };
    std::vector<Cut> cuts;  // Connections::CutOff, where there is any
  };
  // The part that is filtered: irradiance, SH and what photons do to it side by side, four registers.
  static constexpr size_t kWide = 32, kLight = 30;
  struct alignas(32) PartLight {
    std::array<float, kWide> numbers{};
    Rgb variance;
  };
  struct Smoothed {
    LightPart light;
    bool changed = false;
    double bias_square = 0;
    float photons_before = 0, photons_after = 0;  // sums of the squares of TexelLight::photon_noise
  };
  // A block's texels and those around it.
  struct Workspace {
    static constexpr int kSide = kBlock + 2 * SimilarTexels::kHalo;
    SimilarTexels weights{kBlock, kBlock};
    std::vector<PartLight> light = std::vector<PartLight>(size_t{kSide} * kSide);
    PartLight& At(int x, int y) {
      return light[static_cast<size_t>((y + SimilarTexels::kHalo) * kSide + x + SimilarTexels::kHalo)];
    }
  };

  void AddBlock(int left, int top) {
    Block block{left, top, texels_.size(), 0, {}};
    for (int y = top; y < std::min(top + kBlock, connections_.height()); ++y) {
      for (int x = left; x < std::min(left + kBlock, connections_.width()); ++x) {
        if (connections_.PartOf(x, y) != 0) texels_.push_back(static_cast<uint32_t>(TexelAt(x, y)));
      }
    }
    block.end = texels_.size();
    if (block.begin < block.end) blocks_.push_back(block);
  }

  void Cut(Block& block) const {
    for (size_t k = block.begin; k < block.end; ++k) {
      const Texel& texel = map_.texels[texels_[k]];
      const WindowSet cut = connections_.CutOff(texel.x, texel.y);
      if (cut.any()) block.cuts.push_back({texel.x - block.left, texel.y - block.top, cut});
    }
  }

  // The weights of a block's texels. False where nothing is noisy.
  bool Weigh(const Block& block, Workspace& work) const {
    SimilarTexels& weights = work.weights;
    weights.Clear();
    bool noisy = false;
    constexpr int kHalo = SimilarTexels::kHalo;
    for (int y = -kHalo; y < kBlock + kHalo; ++y) {
      for (int x = -kHalo; x < kBlock + kHalo; ++x) {
        if (!connections_.Contains(block.left + x, block.top + y)) continue;
        const uint16_t part = connections_.PartOf(block.left + x, block.top + y);
        if (part == 0) continue;
        const TexelLight& light = LightAt(block.left + x, block.top + y);
        PartLight& filtered = work.At(x, y) = PartOf(light);
        const float variance = LuminanceVariance(filtered.variance);
        noisy |= variance > 0;
        weights.Put(x, y, ValueOf(light), variance, part);
      }
    }
    if (!noisy) return false;
    weights.Compare(true);
    for (const Block::Cut& cut : block.cuts) weights.CutOff(cut.x, cut.y, cut.texels);
    weights.Regress(kMargin);
    return true;
  }

  int32_t TexelAt(int x, int y) const {
    const auto width = static_cast<size_t>(connections_.width());
    return map_.texel_at[page_][static_cast<size_t>(y) * width + static_cast<size_t>(x)];
  }
  const TexelLight& LightAt(int x, int y) const { return lights_[TexelAt(x, y)]; }

  // Luminance of the part that is filtered.
  float ValueOf(const TexelLight& light) const {
    const float indirect = Luminance(light.indirect.irradiance);
    return signal_ == Signal::kIndirect ? indirect : Luminance(light.irradiance) - indirect;
  }

  Rgb VarianceOf(const TexelLight& light) const {
    return signal_ == Signal::kIndirect ? light.indirect.variance : light.direct_variance;
  }

  void Connect(uint32_t i) {
    const Texel& texel = map_.texels[i];
    const TexelLight& light = lights_[i];
    if (!light.valid) return;
    for (int k = 0; k < 4; ++k) {
      if (!(light.open >> k & 1)) continue;
      const int x = texel.x + kNeighbours[k][0], y = texel.y + kNeighbours[k][1];
      if (!connections_.Contains(x, y)) continue;
      const int32_t other = TexelAt(x, y);
      if (other >= 0 && lights_[other].valid) connections_.Connect(texel.x, texel.y, k);
    }
  }

  static_assert(sizeof(LightPart) == 33 * sizeof(float) && offsetof(LightPart, variance) == 30 * sizeof(float) &&
                offsetof(TexelLight, variance) == 30 * sizeof(float));

  PartLight PartOf(const TexelLight& light) const {
    PartLight part;
    part.variance = VarianceOf(light);
    const float *whole = &light.irradiance.x, *indirect = &light.indirect.irradiance.x;
    for (size_t k = 0; k < kLight; ++k) {
      part.numbers[k] = signal_ == Signal::kIndirect ? indirect[k] : whole[k] - indirect[k];
    }
    if (signal_ == Signal::kIndirect) std::copy_n(light.photon_noise.begin(), kWide - kLight, &part.numbers[kLight]);
    return part;
  }

  // (x, y) is in the block.
  Smoothed Smooth(int x, int y, Workspace& work) const {
    const float own_weight = work.weights.Weight(x, y, 0, 0);
    if (own_weight == 1) return {};
    std::array<float, kWide> sum{};
    Rgb variance;
    for (int dy = -kWindowRadius; dy <= kWindowRadius; ++dy) {
      for (int dx = -kWindowRadius; dx <= kWindowRadius; ++dx) {
        const float weight = work.weights.Weight(x, y, dx, dy);
        if (weight == 0) continue;
        const PartLight& light = work.At(x + dx, y + dy);
        for (size_t k = 0; k < kWide; ++k) sum[k] += light.numbers[k] * weight;
        variance += light.variance * (weight * weight);
      }
    }
    const SimilarTexels::Mean& mean = work.weights.MeanOf(x, y);
    const float chosen = mean.follows * mean.follows - own_weight * own_weight;  // the weights' part
    const PartLight& own = work.At(x, y);
    Smoothed result{LightOf(sum, variance + own.variance * chosen)};
    result.bias_square = static_cast<double>(mean.bias_square);
    for (size_t k = kLight; k < kWide; ++k) {
      const float square = own.numbers[k] * own.numbers[k];
      result.photons_before += square;
      result.photons_after += sum[k] * sum[k] + square * chosen;
    }
    const Rgb irradiance = result.light.irradiance;
    result.changed = std::min({irradiance.x, irradiance.y, irradiance.z}) >= 0;
    return result;
  }

  static LightPart LightOf(const std::array<float, kWide>& numbers, Rgb variance) {
    std::array<float, sizeof(LightPart) / sizeof(float)> light{};
    std::copy_n(numbers.begin(), kLight, light.begin());
    LightPart part = std::bit_cast<LightPart>(light);
    part.variance = variance;
    return part;
  }

  // By charts: weights that avoid a bright stray lose its light, so the sum is brought back to what it was; what they
  // blur is counted as variance: one texel's bias is a guess, a chart's is not; and of the photons' noise as much is
  // left as of the numbers that stand for it.
  void Settle(std::vector<Smoothed>& smooth) {
    struct Sum {
      double before = 0, after = 0, variance = 0, bias_square = 0, photons_before = 0, photons_after = 0, texels = 0;
      void Add(double value, const Smoothed& one) {
        before += value;
        after += static_cast<double>(Luminance(one.light.irradiance));
        variance += static_cast<double>(LuminanceVariance(one.light.variance));
        bias_square += one.bias_square;
        photons_before += static_cast<double>(one.photons_before);
        photons_after += static_cast<double>(one.photons_after);
        texels += 1;
      }
    };
    std::map<int32_t, Sum> charts;
    Sum all;
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (!smooth[k].changed) continue;
      const auto value = static_cast<double>(ValueOf(lights_[texels_[k]]));
      charts[map_.texels[texels_[k]].chart].Add(value, smooth[k]);
      all.Add(value, smooth[k]);
    }
    for (size_t k = 0; k < texels_.size(); ++k) {
      if (!smooth[k].changed) continue;
      const Sum& sum = charts[map_.texels[texels_[k]].chart];
      LightPart& light = smooth[k].light;
      if (sum.variance > 0 && sum.bias_square > 0) {
        light.variance = light.variance * static_cast<float>(1 + sum.bias_square / sum.variance);
      }
      if (sum.photons_before > 0) {
        // Few texels say little, so that the page has a say.
        const double some = kPageSays * sum.photons_before / sum.texels;
        const double left = kPhotonMargin * (sum.photons_after + some * all.photons_after / all.photons_before) /
                            (sum.photons_before + some);
        TexelLight& whole = lights_[texels_[k]];
        const Rgb sampled = whole.direct_variance + whole.indirect.variance;
        whole.variance = sampled + (whole.variance - sampled) * static_cast<float>(std::max(0.0, std::min(1.0, left)));
      }
      if (!(sum.after > 0)) continue;
      const float scale = static_cast<float>(sum.before / sum.after);
      light.irradiance = light.irradiance * scale;
      for (Rgb& lambda : light.sh.lambda) lambda = lambda * scale;
      light.variance = light.variance * (scale * scale);
    }
  }

  // seams: of one texel. Its mean and those beyond its chart's border, as far as they differ by no more than their
  // noise.
  bool Join(std::span<const Seam> seams, LightPart& result, double& bias_square) const {
    const TexelLight& light = lights_[seams.front().texel];
    const float own_value = ValueOf(light), own_variance = LuminanceVariance(VarianceOf(light));
    const PartLight own = PartOf(light);
    std::array<float, kWide> sum = own.numbers;
    Rgb variance = own.variance;
    float total = 1, moved = 0;
    for (const Seam& seam : seams) {
      const TexelLight& other = lights_[seam.other];
      const float by = ValueOf(other) - own_value, its_variance = LuminanceVariance(VarianceOf(other));
      if (!(own_variance > 0) || !(its_variance > 0)) continue;
      const float weight = Likeness(kOfOne * by * by / (own_variance + its_variance)) *
                           Nearness(seam.distance * seam.distance) *
                           std::min(1.0f, kMuchNoisier * own_variance / its_variance);
      const PartLight part = PartOf(other);
      for (size_t k = 0; k < kWide; ++k) sum[k] += weight * part.numbers[k];
      variance += part.variance * (weight * weight);
      total += weight;
      moved += weight * by;
    }
    if (total == 1) return false;
    for (float& number : sum) number /= total;
    result = LightOf(sum, variance / (total * total));
    moved /= total;
    const float noise = own_variance * (1 - 2 / total) + LuminanceVariance(result.variance);
    bias_square = static_cast<double>(moved * moved - noise / kMargin);
    return true;
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
  Connections connections_;
  std::vector<Block> blocks_;
  std::vector<uint32_t> texels_;  // connected ones, block by block
};

}  // namespace

void FilterPage(const TexelMap& map, int page, std::span<TexelLight> lights, std::span<const Seam> seams,
                FilterCounters& counters) {
  std::vector<bool> filtered(lights.size(), false);
  const bool noisy = std::any_of(lights.begin(), lights.end(),
                                 [](const TexelLight& light) { return MaxComponent(light.direct_variance) > 0; });
  PageFilter filter(map, page, lights);
  for (const Signal signal : {Signal::kDirect, Signal::kIndirect}) {
    if (signal == Signal::kDirect && !noisy) continue;
    counters.bias_square += filter.Run(signal, filtered) + filter.RunAlong(seams, signal, filtered);
  }
  counters.filtered += std::count(filtered.begin(), filtered.end(), true);
}

std::vector<Seam> SeamsOf(const World& world, const TexelMap& map, int page, std::span<const TexelLight> lights,
                          FilterCounters& counters) {
  std::vector<bool> valid;
  std::vector<uint8_t> open;
  for (const TexelLight& light : lights) {
    valid.push_back(light.valid);
    open.push_back(light.open);
  }
  return FindSeams(world, map, page, valid, open, counters.rays);
}

}  // namespace bakewell
