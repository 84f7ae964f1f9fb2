#pragma once

#include <span>

#include "core/scene/scene.h"

namespace bakewell {

// Linear colour (sRGB decoded before filtering) of a texture at `uv`, after the reference's KHR_texture_transform, with
// the sampler's wrap modes; nearest or bilinear.
Rgb SampleColor(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Alpha in [0,1], likewise.
float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Bounds of SampleColor and SampleAlpha.
struct TexelRange {
  Rgb least{}, most{1, 1, 1};
  float least_alpha = 0, most_alpha = 1;
};
// Over the hull of some texture coordinates, from the texels that the filter reaches from its bounding box; 0 to 1
// where that holds more than `most_texels` of them.
TexelRange RangeOver(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners, double most_texels);

}  // namespace bakewell
