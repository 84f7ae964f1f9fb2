#pragma once

#include <span>

#include "worker/finish/page.h"
#include "worker/task/executor.h"

namespace bakewell {

// The files of one page, as bytes: lightmap-P.irradiance.exr, .sh.exr, .variance.exr, lightmap-P.png and
// lightmap-P.charts.json. `lights` holds one element per TexelMap::texels; those of other pages are not looked at.
// kUnavailable: an encoder refuses.
absl::StatusOr<MadeOutputs> PageFiles(const TexelMap& map, std::span<const TexelLight> lights, int page);

}  // namespace bakewell
