#pragma once

#include <array>
#include <span>
#include <utility>

#include "core/scene/scene.h"

namespace bakewell {

// Linear colour (sRGB decoded before filtering) of a texture at `uv`, after the reference's KHR_texture_transform, with
// the sampler's wrap modes; nearest or bilinear.
Rgb SampleColor(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Alpha in [0,1], likewise.
float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Bounds of SampleColor and SampleAlpha from above.
struct TexelBound {
  Rgb color{1, 1, 1};
  float alpha = 1;
};
// Over the hull of some texture coordinates, from the texels that the filter reaches from its bounding box; 1 where
// that holds more than 256 of them.
TexelBound MostOver(const Texture& texture, const TextureRef& ref, std::span<const Vec2f> corners);

// Bounds of SampleAlpha over the triangle with these texture coordinates, from the texels of its bounding box: {least,
// most}. {0, 1} where that holds more than 65,536 of them.
std::pair<float, float> AlphaRange(const Texture& texture, const TextureRef& ref, const std::array<Vec2f, 3>& corners);

}  // namespace bakewell
