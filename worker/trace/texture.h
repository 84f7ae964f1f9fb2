#pragma once

#include <array>
#include <utility>

#include "core/scene/scene.h"

namespace bakewell {

// Linear colour (sRGB decoded before filtering) of a texture at `uv`, after the reference's KHR_texture_transform, with
// the sampler's wrap modes; nearest or bilinear.
Rgb SampleColor(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Alpha in [0,1], likewise.
float SampleAlpha(const Texture& texture, const TextureRef& ref, Vec2f uv);

// Bounds of SampleAlpha over the triangle with these texture coordinates, from the texels of its bounding box: {least,
// most}. {0, 1} where that holds more than 65,536 of them.
std::pair<float, float> AlphaRange(const Texture& texture, const TextureRef& ref, const std::array<Vec2f, 3>& corners);

}  // namespace bakewell
