#pragma once

#include <span>
#include <vector>

#include "core/image/image.h"
#include "worker/gather/tile.h"

namespace bakewell {

// The images of one page (schema/lightmap.md). Row 0 is v = 0.
struct PageImages {
  Image irradiance;  // R G B [W m^-2] at the geometric normal, A coverage
  Image sh;  // sh0.R sh0.G sh0.B ... sh8.B: lambda_i of the incident radiance, world frame, windowed where they ring
  Image variance;  // R G B variance of the irradiance, A share of back faces in the hemisphere
};

inline constexpr int kGutterTexels = 8;

// Puts texel results on the page, fills invalid texels from valid ones of their chart and the gutter from the nearest
// covered texels, kGutterTexels wide. `lights` holds one element per TexelMap::texels.
PageImages FinishPage(const TexelMap& map, std::span<const TexelLight> lights, int page);

}  // namespace bakewell
