#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "core/artifact/skip.h"
#include "core/atlas/layout.h"
#include "core/sh/sh.h"
#include "worker/gather/path.h"
#include "worker/texel/texels.h"

namespace bakewell {

// When a texel has had enough.
struct GatherOptions {
  int min_samples = 16;  // powers of two, at least 4
  int max_samples = 1024;
  int worst_samples = 1024;  // at most max_samples: with more, a texel goes on for its tile's sum of errors alone
  int mean_samples = 1024;   // and then its tile may have no more a texel, or a texel's share of light, on average
  float target_error = 0;    // standard error over sqrt(mean * max(irradiance, floor_share * mean)); 0: never stops
  float floor_share = 0.25f;
  float mean_irradiance = 0;  // luminance, of the whole bake, as the photons saw it [W m^-2]
  uint32_t seed = 0;
  float photon_flux = 0;  // MeanPhotonFlux
  SkipSet no_skip;
  bool filter = true;  // the page will be filtered: the gather may stop where that brings its part to the target
};

// What one of a texel's two estimators found (light sampling, final gather).
struct LightPart {
  Rgb irradiance;
  RadianceSh sh;
  Rgb variance;  // of irradiance, by sampling alone
};

// One texel's result. Vectors in the world frame.
struct TexelLight {
  Rgb irradiance;       // at the geometric normal [W m^-2]
  RadianceSh sh;        // incident radiance over the hemisphere around the geometric normal
  Rgb variance;         // of irradiance, sampling and photons together
  LightPart indirect;   // of the three above, what the final gather found
  Rgb direct_variance;  // of the variance, what light sampling left
  // What the finite number of photons does to the irradiance's luminance: two numbers whose squares are its variance on
  // average, and which neighbours have in common as far as they have the photons in common.
  std::array<float, 2> photon_noise{};
  uint8_t open = 0;  // ConnectTexel: which neighbours the filter may look at
  float backface_share = 0;
  bool valid = true;  // false: inside other geometry; light is zero and no evidence for anybody
  int direct_samples = 0, indirect_samples = 0;
};

// Variance of the luminance whose channels have these variances and err together, as those of one estimate do.
inline float LuminanceVariance(Rgb variance) {
  const float deviation = Luminance(Rgb{std::sqrt(variance.x), std::sqrt(variance.y), std::sqrt(variance.z)});
  return deviation * deviation;
}

// Bakes the texels of one tile: a pure function of the scene, the cache, the options and the tile's number. Element i
// is texel tile_begin[tile] + i.
std::vector<TexelLight> GatherTile(const GatherScene& scene, const AtlasLayout& layout, const TexelMap& map, int tile,
                                   const GatherOptions& options, GatherCounters& counters);

// What keys the random numbers of a texel: its place, not its number.
uint32_t TexelKey(const Texel& texel, uint32_t seed);

}  // namespace bakewell
