#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/math/vec.h"
#include "server/chart/flatten/flat_chart.h"
#include "server/chart/mesh/surface.h"
#include "server/chart/options.h"

// Lightmap UVs for meshes, with xatlas' concepts and names (jpcy/xatlas, xatlas.h): fill MeshDecls, call Generate, read
// Atlas. Pure functions: same input, same bytes, for any number of threads; TBB's global pool is used.
namespace bakewell::chart {

// One input mesh. The spans are only read during the call.
struct MeshDecl {
  std::span<const Vec3f> vertexPositionData;  // V; not finite: the faces there get no chart
  std::span<const Vec2f> vertexUvData;        // V, or empty: the input's UVs, for useInputMeshUvs and texture seams
  std::span<const uint32_t> indexData;        // 3 T, each below V, counter-clockwise seen from the front
  float density = 1;                          // ours: factor on the texel density of this mesh's charts
};

// An output vertex. Vertices are split where charts meet.
struct Vertex {
  int32_t atlasIndex = -1;  // the page; -1: the vertex is in no chart
  int32_t chartIndex = -1;  // into Mesh::chartArray; -1: the vertex is in no chart
  float uv[2] = {0, 0};     // texels, not divided by the page's size; v down
  uint32_t xref = 0;        // the input vertex
};

// A connected set of faces laid into the plane.
struct Chart {
  std::vector<uint32_t> faceArray;  // input triangles
  uint32_t atlasIndex = 0;          // the page
};

// An output mesh: input triangle k is indexArray[3 k .. 3 k + 2].
struct Mesh {
  std::vector<Chart> chartArray;
  std::vector<uint32_t> indexArray;  // 3 T
  std::vector<Vertex> vertexArray;
  std::vector<FaceState> faceState;  // T, ours: why a triangle has no chart
};

struct Atlas {
  std::vector<Mesh> meshes;        // one per MeshDecl
  std::vector<float> utilization;  // one per page: touched texels (blocks, where aligned) / all
  uint32_t width = 0, height = 0;  // of every page, texels
  uint32_t atlasCount = 0;         // pages
  uint32_t chartCount = 0;         // all meshes
  float texelsPerUnit = 0;
};

// The charts of one mesh in the plane, before packing.
struct MeshCharts {
  Surface surface;
  std::vector<FlatChart> charts;
  std::vector<float> density;  // one per chart, factor on the page's density
};

// Segmentation and parameterisation only. kInvalidArgument: an index is out of range, a count is not a multiple of 3.
absl::StatusOr<std::vector<MeshCharts>> ComputeCharts(std::span<const MeshDecl> meshes, const ChartOptions& options);

// Packing only; may be called again with other densities or options. meshes: those that `charts` were computed from.
// kInvalidArgument: an option out of range.
absl::StatusOr<Atlas> PackCharts(std::span<const MeshDecl> meshes, std::span<const MeshCharts> charts,
                                 const PackOptions& options);

// ComputeCharts, then PackCharts.
absl::StatusOr<Atlas> Generate(std::span<const MeshDecl> meshes, const ChartOptions& chart_options,
                               const PackOptions& pack_options);

}  // namespace bakewell::chart
