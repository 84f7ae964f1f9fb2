#pragma once

#include <cstdint>

namespace bakewell::chart {

// How surfaces are cut into charts. The names, and what 0 means, are xatlas'; lengths and areas are in input units.
struct ChartOptions {
  float maxChartArea = 0;           // a chart grows no further than this area; 0: no limit
  float maxBoundaryLength = 0;      // ... nor than this outline; 0: no limit
  float normalDeviationWeight = 2;  // cost of normals that turn away from the chart's mean
  float roundnessWeight = 0.01f;    // cost of an outline longer than a circle's
  float straightnessWeight = 6;     // cost of a ragged border between two charts
  float normalSeamWeight = 4;       // cost of growing over a sharp edge; above 1000 sharp edges always are seams
  float textureSeamWeight = 0.5f;   // cost of growing over a seam of the input UVs
  float maxCost = 2;                // charts stop growing where the weighted sum exceeds this
  uint32_t maxIterations = 2;       // passes that round charts and straighten their borders after growing
  bool useInputMeshUvs = false;     // keep the input's UV charts (rescaled to one density), generate where invalid
  bool fixWinding = false;          // kept for compatibility: UVs always run counter-clockwise here
  float maxStretch = 1.004f;        // ours: bound of a chart's Sander L2 stretch; a chart above it is split
};

// How charts are laid out on pages. The names, and what 0 means, are xatlas'.
struct PackOptions {
  uint32_t maxChartSize = 0;       // texels; charts longer than this are scaled down; 0: the page's size
  uint32_t padding = 2;            // empty texels between any two charts
  float texelsPerUnit = 0;         // density; 0: searched so that one page of `resolution` is full
  uint32_t resolution = 0;         // page side, never exceeded; 0: 1024 if texelsPerUnit is 0, else what one page needs
  uint32_t maxResolution = 0;      // ours: longest page side where resolution is 0 and texelsPerUnit is not; what one
                                   // such page cannot hold goes on several, all as small as they can be; 0: 8192
  bool bilinear = true;            // a gutter of at least 2, so that no filter tap on a chart reads another
  bool blockAlign = false;         // no two charts share a 4x4 block
  bool bruteForce = false;         // search longer for a denser packing
  bool rotateChartsToAxis = true;  // turn charts so that their bounding rectangle is upright
  bool rotateCharts = true;        // try quarter turns
};

}  // namespace bakewell::chart
