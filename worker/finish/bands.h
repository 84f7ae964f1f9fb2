#pragma once

#include <span>

#include "core/artifact/skip.h"
#include "worker/gather/tile.h"

namespace bakewell {

// Sets bands of the spherical harmonics of a page's charts to zero where they cannot be told from nothing: l = 2, then
// l = 1, where for every other normal of the chart's texels the irradiance changes by no more than `target_error` of
// the chart's own mean (root mean square over the texels, of the bound A_l sqrt((2 l + 1)/(4 pi)) |lambda_l| of the
// addition theorem, luminance). Counts bands of charts in, and saved coefficients of texels.
void DropBands(const TexelMap& map, int page, float target_error, std::span<TexelLight> lights, SkipCount& count);

}  // namespace bakewell
