#include "worker/gather/budget.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "worker/gather/noise.h"

namespace bakewell {
namespace {

constexpr float kGatherCost = 2.5f;  // of a gather ray and what it meets, over a light sample
constexpr double kSpare = 10;        // light samples a texel: a fifth of what one with four samples costs
constexpr float kBoundless = 1e30f;  // error of what tolerates none
constexpr float kMargin = static_cast<float>(SetNoise::kMargin);  // what is reported is safe, what stops is likely
constexpr float kChangedShare = 0.25f;                            // of a tile's texels; fewer leave the rest as it is
constexpr size_t kTellingSets = 32;                               // fewer sets of a tile say little about all

int Doublings(int samples, int most) {
  return std::max(1, static_cast<int>(std::bit_width(static_cast<unsigned>(most / samples)))) - 1;
}

std::vector<float> Sum(std::vector<float> a, const std::vector<float>& b) {
  for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
  return a;
}

}  // namespace

void TileBudget::Part::Add(Rgb irradiance, float its_variance, int its_samples) {
  value.push_back(Luminance(irradiance));
  variance.push_back(its_variance);
  samples.push_back(its_samples);
}

void TileBudget::Filtered::Apply(SmoothTile& tile, const TilePool& pool, Part& part) {
  if (std::none_of(part.variance.begin(), part.variance.end(), [](float variance) { return variance > 0; })) return;
  if (smoothed.empty() || changed > kChangedShare * static_cast<float>(smoothed.size())) {
    smoothed = tile.Smooth(part.value, part.variance, kMargin);
    changed = 0;
    std::vector<float> bias;
    for (const SimilarTexels::Mean& mean : smoothed) bias.push_back(mean.bias_square);
    bias_square = pool.Mean(bias);
  }
  for (size_t i = 0; i < smoothed.size(); ++i) {
    // What the window's texels say of their variance may have missed what is rare.
    const float filtered = std::max(smoothed[i].variance, smoothed[i].square * part.pooled[i]);
    part.pooled[i] = std::min(part.pooled[i], filtered + std::max(0.0f, bias_square[i]));
    part.value[i] = smoothed[i].value;
  }
}

void TileBudget::WillBeFiltered(SmoothTile tile) { tile_.emplace(std::move(tile)); }

float TileBudget::Weighing(float irradiance) const {
  const float mean = options_.mean_irradiance;
  return std::sqrt(mean * std::max(irradiance, options_.floor_share * mean));
}

// How far the sets that took part in the last round are better than their blocks say.
void TileBudget::CorrectVariances(std::vector<TexelWork>& all) const {
  SetNoise direct, indirect;
  for (const TexelWork& work : all) {
    if (!work.valid) continue;
    if (work.direct_active) direct.Add(work.direct, Weighing(Luminance(work.direct.Irradiance())));
    if (work.indirect_active) indirect.Add(work.indirect, Weighing(Luminance(work.indirect.Irradiance())));
  }
  for (TexelWork& work : all) {
    if (work.direct_active && work.direct_samples >= kBlocks && direct.sets() >= kTellingSets)
      work.direct_correction = direct.Correction();
    if (work.indirect_active && work.indirect_samples >= kBlocks && indirect.sets() >= kTellingSets)
      work.indirect_correction = indirect.Correction();
  }
}

void TileBudget::Decide(std::vector<TexelWork>& all) {
  CorrectVariances(all);
  Part direct, indirect;
  for (const TexelWork& work : all) {
    direct.Add(work.direct.Irradiance(), work.direct.LuminanceVariance() * work.direct_correction, work.direct_samples);
    indirect.Add(work.indirect.Irradiance(), work.indirect.LuminanceVariance() * work.indirect_correction,
                 work.indirect_samples);
    direct_.changed += work.direct_active ? 1 : 0;
    indirect_.changed += work.indirect_active ? 1 : 0;
  }
  if (!pool_) {
    std::vector<bool> valid;
    for (const TexelWork& work : all) valid.push_back(work.valid);
    pool_.emplace(map_, begin_, valid);
  }
  direct.pooled = pool_->Variance(direct.variance, direct.samples);
  indirect.pooled = pool_->Variance(indirect.variance, indirect.samples);
  // A stray sample must not raise its own tolerance: neighbours or the smoothed light judge.
  Demand demand = DemandOf(all, direct, indirect, pool_->Mean(Sum(direct.value, indirect.value)));
  if (options_.filter && options_.target_error > 0 && !IsMet(demand)) {
    direct_.Apply(*tile_, *pool_, direct);
    indirect_.Apply(*tile_, *pool_, indirect);
    demand = DemandOf(all, direct, indirect, Sum(direct.value, indirect.value));
  }
  if (!spare_) spare_ = kSpare * static_cast<double>(demand.texels);
  Grant(demand, all);
}

// By pooled variances and irradiance a texel; two claims for each, of direct and of indirect light.
Demand TileBudget::DemandOf(const std::vector<TexelWork>& all, const Part& direct, const Part& indirect,
                            const std::vector<float>& light) const {
  Demand demand;
  double squares = 0, shares = 0;
  for (size_t i = 0; i < all.size(); ++i) {
    if (!all[i].valid) continue;
    ++demand.texels;
    squares += static_cast<double>(Tolerated(light[i]) * Tolerated(light[i]));
    shares += static_cast<double>(std::max(1.0f, light[i] / options_.mean_irradiance));
  }
  demand.ceiling = static_cast<double>(1 + kGatherCost) * static_cast<double>(options_.mean_samples) * shares;
  // Together they may be off by what the tile tolerates: what dim texels leave of theirs is little to a bright one.
  const auto fair = static_cast<float>(squares / static_cast<double>(demand.texels));
  const int worst = std::min(options_.worst_samples, options_.max_samples);
  demand.claims.reserve(2 * all.size());
  for (size_t i = 0; i < all.size(); ++i) {
    const TexelWork& work = all[i];
    const float square = Tolerated(light[i]) * Tolerated(light[i]);
    const auto claim = [&](bool has, int samples, float cost, float variance, bool spared_for) {
      const float error = has && variance > 0 ? std::min(variance / (kMargin * square), kBoundless) : 0;
      const int doublings = has ? Doublings(samples, worst) : 0;
      const int further = has ? Doublings(samples, options_.max_samples) - doublings : 0;
      demand.claims.push_back(
          {error, cost * static_cast<float>(samples), doublings, further, std::max(1.0f, square / fair), spared_for});
    };
    const float missed = work.Missed(light[i]);
    // Edges of shadows are sharp: what the filter leaves of direct light's noise is on few texels, and cheap to mend.
    claim(work.has_direct, work.direct_samples, 1, std::max(direct.pooled[i], missed * missed), true);
    claim(work.has_indirect, work.indirect_samples, kGatherCost, indirect.pooled[i], false);
  }
  return demand;
}

// Makes active who gets more samples: without a target everybody.
void TileBudget::Grant(const Demand& demand, std::vector<TexelWork>& work) {
  const std::vector<Claim>& claims = demand.claims;
  const std::vector<bool> granted =
      options_.target_error > 0 ? Allot(demand, *spare_) : std::vector<bool>(claims.size(), true);
  const auto goes_on = [&](size_t i) { return granted[i] && claims[i].doublings + claims[i].further > 0; };
  for (size_t i = 0; i < work.size(); ++i) {
    work[i].direct_active = goes_on(2 * i);
    work[i].indirect_active = goes_on(2 * i + 1);
  }
}

}  // namespace bakewell
