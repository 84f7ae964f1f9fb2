#pragma once

#include "core/atlas/layout.h"
#include "core/base/status.h"
#include "core/scene/scene.h"
#include "server/chart/options.h"

namespace bakewell {

// How GenerateCharts chooses densities and pages.
struct GenerateOptions {
  int resolution = 0;          // page side in texels; 0: max_resolution
  float texels_per_metre = 0;  // 0: the largest density at which everything fits one page of `resolution`
  int max_resolution = 1024;   // page side where texels_per_metre decides the number of pages
  chart::ChartOptions chart;
  chart::PackOptions pack{.blockAlign = true};  // resolution and texelsPerUnit are overwritten from above
};

// New charts for every lightmapped object of a scene: no overlaps, a gutter, one density times Object::density. Objects
// that are not lightmapped get empty ObjectCharts; degenerate and non-finite triangles get kNoChart and UVs inside a
// page. Pages are multiples of 4 texels. Same layout for any number of threads. kInvalidArgument names the object.
absl::StatusOr<AtlasLayout> GenerateCharts(const Scene& scene, const GenerateOptions& options);

}  // namespace bakewell
