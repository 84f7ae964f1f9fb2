#pragma once

#include <span>
#include <vector>

#include "core/artifact/skip.h"
#include "worker/photon/cache.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// What the photons say about places without light. Where an irradiance of `least` [W m^-2, luminance] would have sent
// kSure photons to the cells around a place and none came, a Poisson count says that less than that arrives there but
// for one place in exp(kSure). `photon_flux` is what a photon carries on the mean [W, luminance].
class PhotonDarkness {
 public:
  static constexpr double kSure = 6;

  PhotonDarkness(const SurfaceCells& cells, const RadianceCache& cache, float least, float photon_flux)
      : cells_(cells), cache_(cache), needed_area_(Area(least, photon_flux)) {}

  struct Dark {
    bool direct = false;  // no light comes straight from a light
    bool all = false;     // nor after a bounce
  };
  // Of a texel: its centre and its corners are dark.
  Dark Of(const TexelSampler& sampler) const;

 private:
  static double Area(float least, float photon_flux);
  Dark At(const TexelPoint& point) const;

  const SurfaceCells& cells_;
  const RadianceCache& cache_;
  const double needed_area_;  // [m^2]
};

// Flux [W, luminance] that a photon brought to the surface on the mean; 0 without photons.
float MeanPhotonFlux(const SurfaceCells& cells, const RadianceCache& cache);

// What a texel need not look for.
enum class Leaves : uint8_t { kNothing, kDirect, kAll };

// Draws those that are audited, of the texels that leave out `leaves`: one in 64, at least four, by their keys. One flag
// a texel.
std::vector<bool> DrawAudit(std::span<const uint32_t> keys, std::span<const Leaves> texels, Leaves leaves);

// What the texels of one tile that are audited, computed in full, say about those like them that are not.
class SkipAudit {
 public:
  // An audited texel found light [luminance, in means of the bake] that would have been lost, with `rays`; more than
  // `tolerated` fails the tile.
  void Found(Leaves leaves, float lost, float tolerated, int64_t rays);
  bool passes() const { return passes_; }
  // `skipped` texels were left out; each cost `rays` all the same.
  void Count(Skip skip, Leaves leaves, int64_t skipped, int64_t of, int64_t rays, SkipTally& tally) const;
  void Count(SkipTally& tally) const;

 private:
  struct Sum {
    int64_t texels = 0, rays = 0;
  };
  std::array<Sum, 3> of_;  // by Leaves
  int64_t largest_ppm_ = 0;
  int64_t square_ppm2_ = 0;
  bool passes_ = true;
};

}  // namespace bakewell
