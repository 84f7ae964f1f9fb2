#pragma once

#include <span>
#include <vector>

#include "core/artifact/skip.h"
#include "worker/photon/cache.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// Where the photons say that no light arrives. Where an irradiance of `least` [W m^-2, luminance] would have sent kSure
// photons to the cells around a place and none came, a Poisson count says that less than that arrives there but for one
// place in exp(kSure). `photon_flux` is what a photon carries on the mean [W, luminance].
class PhotonDarkness {
 public:
  static constexpr double kSure = 6;

  PhotonDarkness(const SurfaceCells& cells, const RadianceCache& cache, float least, float photon_flux);

  // Of a texel: its centre and its corners are dark.
  bool Covers(const TexelSampler& sampler) const;

 private:
  bool IsDark(size_t cell) const;
  bool CoversPlace(const SurfacePoint& point) const;

  const SurfaceCells& cells_;
  const RadianceCache& cache_;
  const double needed_area_;  // [m^2]
};

// Flux [W, luminance] that a photon brought to the surface on the mean; 0 without photons.
float MeanPhotonFlux(const SurfaceCells& cells, const RadianceCache& cache);

// Irradiance of a texel, luminance, as the photons saw it.
float ExpectedIrradiance(const SurfaceCells& cells, const RadianceCache& cache, const TexelMap& map,
                         const Texel& texel);

// The least irradiance of texels [begin, end), luminance, as the photons saw it. What matters little is judged by this
// and not by the bake's mean: a cellar of dim lamps under a sunlit level is not black to who stands in it.
float DimmestIrradiance(const SurfaceCells& cells, const RadianceCache& cache, const TexelMap& map, uint32_t begin,
                        uint32_t end);

// Which of the texels that leave something out are audited, by their keys: one in 64, at least four. One flag a texel.
std::vector<bool> DrawAudit(std::span<const uint32_t> keys, const std::vector<bool>& leaves_out);

// What texels of a tile that are audited, computed in full, say about those like them that are not.
class SkipAudit {
 public:
  // An audited texel found an irradiance that would have been lost, with `rays`. Any at all fails the tile: what is
  // little beside the mean of a sunlit level is all the light of its cellar. Luminances; it is noted in means of the
  // bake.
  void Found(float lost, float mean, int64_t rays);
  bool passes() const { return passes_; }
  void Count(SkipTally& tally) const;
  // Rays that `texels` more would have cost.
  int64_t RaysOf(int64_t texels) const { return texels_ > 0 ? rays_ * texels / texels_ : 0; }

 private:
  int64_t texels_ = 0, rays_ = 0;
  long long found_ppm_ = 0;
  bool passes_ = true;
};

}  // namespace bakewell
