#pragma once

#include "core/atlas/layout.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

// The charts that a scene brings as TEXCOORD_1: triangles that share an edge with equal UVs at both ends are one chart.
// One page; xref is the identity. Triangles that are degenerate in space or on the page get kNoChart. kInvalidArgument,
// naming the object: no TEXCOORD_1, a UV that is not finite or outside the page by more than a hundredth of a texel.
absl::StatusOr<AtlasLayout> KeepCharts(const Scene& scene, PageSize page);

}  // namespace bakewell
