#pragma once

#include "worker/texel/sampler.h"

namespace bakewell {

// What rays from a texel say about where it lies.
struct TexelValidity {
  bool valid = true;         // some of it sees the open side of the scene
  bool pushed_out = false;   // all of it was inside geometry, and rays now start past the back face beside it
  float backface_share = 0;  // of the probed hemisphere that meets a back face first
  int rays = 0;
};

// Finds the parts of a texel that lie inside other geometry (more than half of their hemisphere meets the back of a
// single-sided surface first) and rules them out in the sampler's mask; a texel that is wholly inside is moved past a
// back face within its own diagonal, if that helps. Only texels whose first few rays meet a back face or something
// within the texel pay for more. With BackfaceMode::kPass nothing has a back.
TexelValidity ProbeValidity(const World& world, uint32_t key, TexelSampler& sampler);

}  // namespace bakewell
