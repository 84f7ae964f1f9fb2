#pragma once

#include <span>
#include <vector>

#include "core/atlas/layout.h"
#include "core/base/status.h"
#include "core/scene/scene.h"
#include "server/chart/atlas.h"
#include "server/chart/options.h"

namespace bakewell {

// How GenerateCharts chooses densities and pages.
struct GenerateOptions {
  int resolution = 0;          // page side in texels; 0: max_resolution, or with texels_per_metre as small as it can be
  float texels_per_metre = 0;  // 0: the largest density at which everything fits one page of `resolution`
  int max_resolution = 1024;   // longest page side where texels_per_metre decides the size and number of pages
  // Factor on the density of each chart, on top of Object::density: empty, or one per AtlasLayout::charts that the same
  // scene and `chart` gave before (their numbering does not depend on densities), as chart::DensityFactors makes them.
  std::vector<float> chart_density = {};
  chart::ChartOptions chart = {};
  chart::PackOptions pack{.blockAlign = true};  // resolution and texelsPerUnit are overwritten from above
};

// New charts for every lightmapped object of a scene: no overlaps, a gutter, one density times Object::density. Objects
// that are not lightmapped get empty ObjectCharts; degenerate and non-finite triangles get kNoChart and UVs inside a
// page. Pages are multiples of 4 texels, all of one size. Same layout for any number of threads. kInvalidArgument names
// the object. kResourceExhausted: more than 256 pages.
absl::StatusOr<AtlasLayout> GenerateCharts(const Scene& scene, const GenerateOptions& options);

// The charts of an atlas as a layout. mesh_of_object: one entry per layout object, the atlas' mesh or -1 (empty
// ObjectCharts).
AtlasLayout ToLayout(const chart::Atlas& atlas, std::span<const int> mesh_of_object);

}  // namespace bakewell
