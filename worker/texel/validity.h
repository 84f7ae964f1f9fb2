#pragma once

#include <cstdint>
#include <optional>

#include "worker/texel/sampler.h"

namespace bakewell {

inline constexpr int kLeastValidityRays = 4;  // of a texel that nothing divides, where nobody knows yet

// What else is near a texel.
struct Surroundings {
  // Anything but the about flat surface of the texel's own chart rises above its plane within two radii of its centre
  // (or so many triangles are there that it is not worth knowing). Where nothing does, nothing divides the texel or
  // stands between it and a neighbour: it is inside or outside as its centre is.
  bool crowded = true;
  // Something with a back, of another chart or of none, stands on or hangs a radius or less above what the texel
  // averages, some of which is behind it, as far as one looked: a part of the texel may lie inside.
  bool divided = true;
};
// footprint: TexelMap::footprint.
Surroundings LookAround(const World& world, const AtlasLayout& layout, const Texel& texel, const TexelSampler& sampler,
                        float footprint);

// What rays from a texel say about where it lies.
struct TexelValidity {
  bool valid = true;         // some of it sees the open side of the scene
  bool pushed_out = false;   // all of it was inside geometry, and rays now start past the back face beside it
  float backface_share = 0;  // of the probed hemisphere that meets a back face first
  int rays = 0;
  int rays_saved = 0;  // by PartSearch::kNear
};

// What rays of the caller's over a texel met.
struct BacksSeen {
  float share = 0;    // of back faces
  float nearest = 0;  // distance of the nearest of them [m]
  int rays = 0;
};

// Finds the parts of a texel that lie inside other geometry (more than half of their hemisphere meets the back of a
// single-sided surface first) and rules them out in the sampler's mask; one that is not crowded is inside or outside as
// its centre is. A texel that is wholly inside is moved past a back face within its own diagonal, if that helps. Texels
// whose first rays meet no back face, and that have nothing standing within their own reach, cost no more than those
// rays. `seen`: without it eight rays find out. With BackfaceMode::kPass nothing has a back. Search::kNear trusts those
// rays where they start all over the texel: it looks for parts of a texel that is not divided only where some met a
// back face, and not where nothing stands within its reach and either nearly all of them did, and what holds for the
// centre holds for all of it, or few did and none near by.
//
// Only `seen` depends on the seed: rays of the probe's own go by the texel's place.
enum class PartSearch : uint8_t { kAll, kNear };
TexelValidity ProbeValidity(const World& world, const Texel& texel, const std::optional<BacksSeen>& seen,
                            PartSearch search, Surroundings around, TexelSampler& sampler);

// Whether a ray's first hit is the back of a single-sided surface.
bool MeetsBack(const World& world, const Hit& hit);

}  // namespace bakewell
