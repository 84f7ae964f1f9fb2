#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "worker/gather/accumulate.h"
#include "worker/gather/direct.h"
#include "worker/gather/guide.h"
#include "worker/gather/spots.h"
#include "worker/gather/tile.h"
#include "worker/texel/validity.h"

namespace bakewell {

// Everything about one texel while its tile is in flight.
struct TexelWork {
  explicit TexelWork(TexelSampler its_sampler) : sampler(std::move(its_sampler)) {}

  TexelSampler sampler;
  TileLights::Choice choice{};
  float expected = 0;  // ExpectedIrradiance
  uint32_t key = 0;
  bool valid = true;
  Surroundings around;
  bool dark = false, audited = false;  // to be left out; but computed all the same
  uint8_t open = 0;
  float direct_correction = 1, indirect_correction = 1;  // of the accumulators' variances
  float backs = 0, nearest_back = std::numeric_limits<float>::infinity(),
        backface_share = 0;                             // gather rays that met a back face [m], their share
  bool has_direct = true, has_indirect = true;          // there is something to sample
  bool direct_active = false, indirect_active = false;  // in the next round
  Accumulator direct{}, indirect{};
  std::optional<GatherGuide> guide{};          // of gather rays, once there are kGuidedFrom
  TileSpots::Choice spots{};                   // that its gather rays are aimed at
  bool guided = false;                         // a guide was looked for
  std::array<float, kVarianceGroups> group{};  // sums of photon-borne irradiance
  int direct_samples = 0, indirect_samples = 0;

  Rgb DirectVariance() const { return direct.Variance() * direct_correction; }
  Rgb IndirectVariance() const { return indirect.Variance() * indirect_correction; }

  // What all samples may have missed of the local lights, as where one of many shines through a slit, when the texel's
  // light (luminance) is about `found`: as much as the photons saw more, but no more than one sample would have
  // brought.
  float Missed(float found) const {
    if (choice.empty) return 0;
    return std::max(0.0f, std::min(expected - found, choice.unoccluded / static_cast<float>(direct_samples)));
  }

  // Variance of the texel's irradiance that comes from the finite number of photons.
  float PhotonVariance() const {
    if (indirect.count() <= 0) return 0;
    float mean = 0, sum = 0;
    for (const float g : group) mean += g / kVarianceGroups;
    for (const float g : group) sum += (g - mean) * (g - mean);
    const float n = indirect.count();
    return sum / (n * n * kVarianceGroups * (kVarianceGroups - 1));
  }

  // Two of the seven directions in which eight groups can differ; their squares are PhotonVariance on average.
  std::array<float, 2> PhotonNoise() const {
    static_assert(kVarianceGroups == 8);
    if (indirect.count() <= 0) return {};
    float alternate = 0, pairs = 0;
    for (size_t g = 0; g < kVarianceGroups; ++g) {
      alternate += g % 2 == 0 ? group[g] : -group[g];
      pairs += g % 4 < 2 ? group[g] : -group[g];
    }
    const float scale = 1 / (kVarianceGroups * indirect.count());
    return {alternate * scale, pairs * scale};
  }

  TexelLight Finish() const {
    TexelLight light;
    light.valid = valid;
    light.backface_share = backface_share;
    if (!valid) return light;
    light.irradiance = direct.Irradiance() + indirect.Irradiance();
    const RadianceSh direct_sh = direct.Sh(), indirect_sh = indirect.Sh();
    for (size_t i = 0; i < kShCoefficients; ++i) light.sh.lambda[i] = direct_sh.lambda[i] + indirect_sh.lambda[i];
    light.indirect = {indirect.Irradiance(), indirect_sh, IndirectVariance()};
    light.direct_variance = DirectVariance();
    light.variance = light.direct_variance + light.indirect.variance;
    // Photon noise is known in luminance; it is spread over the channels as the irradiance is.
    const float luminance = Luminance(light.irradiance);
    if (luminance > 0) {
      const Rgb share = light.irradiance / luminance;
      light.variance += share * share * PhotonVariance();
      light.photon_noise = PhotonNoise();
    }
    light.open = open;
    light.direct_samples = direct_samples;
    light.indirect_samples = indirect_samples;
    return light;
  }
};

}  // namespace bakewell
