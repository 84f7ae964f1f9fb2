#pragma once

#include "core/scene/scene.h"

namespace bakewell {

// Linear colour (sRGB decoded before filtering) of a texture at `uv`, after the reference's KHR_texture_transform, with
// the sampler's wrap modes; nearest or bilinear.
Rgb SampleColor(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Alpha in [0,1], likewise.
float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv);

}  // namespace bakewell
