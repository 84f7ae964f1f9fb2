#pragma once

#include <span>
#include <vector>

#include "client/local/level_bake.h"
#include "server/chart/need.h"

namespace bakewell {

// How much the irradiance changes over each chart: per AtlasLayout::charts its covered area [m^2] and the root mean
// square difference of a texel from the mean of its neighbours, which is what bilinear filtering cannot follow, as a
// gradient [W m^-3]. Half of the texels' own variance is taken off. Charts too small to tell get the mean. lights:
// element i for texels.texels[i]. Pure.
std::vector<chart::ChartNeed> MeasureNeeds(size_t chart_count, const TexelMap& texels,
                                           std::span<const TexelLight> lights);

// Lays a prepared level's generated charts out again, with densities after a preview bake of it and as many covered
// texels, within 1 %, where the settings do not fix the pages; where they do, on those pages. Adds the phase "preview"
// to the clock. Does nothing but warn where the level keeps its own charts. Errors as BakeTexels and GenerateCharts.
absl::Status FollowSignal(const BakeSettings& settings, PhaseClock& clock, Progress& progress, PreparedLevel& prepared);

}  // namespace bakewell
