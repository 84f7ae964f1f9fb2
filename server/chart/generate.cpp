#include "server/chart/generate.h"

#include <string>

#include "server/chart/atlas.h"

namespace bakewell {
namespace {

absl::StatusOr<std::vector<chart::MeshDecl>> LightmappedMeshes(const Scene& scene) {
  std::vector<chart::MeshDecl> meshes;
  for (const Object& object : scene.objects) {
    if (!object.lightmapped) continue;
    if (!(object.density > 0))
      return absl::InvalidArgumentError("object '" + object.name + "': lightmapDensity must be above 0");
    meshes.push_back({.vertexPositionData = object.position,
                      .vertexUvData = {},
                      .indexData = object.index,
                      .density = object.density});
  }
  return meshes;
}

ObjectCharts ToObjectCharts(const chart::Mesh& mesh, int32_t first_chart) {
  ObjectCharts charts;
  charts.index = mesh.indexArray;
  for (const chart::Vertex& vertex : mesh.vertexArray) {
    charts.xref.push_back(vertex.xref);
    charts.uv.push_back({vertex.uv[0], vertex.uv[1]});
  }
  charts.chart_of_triangle.assign(mesh.faceState.size(), kNoChart);
  for (size_t c = 0; c < mesh.chartArray.size(); ++c)
    for (const uint32_t triangle : mesh.chartArray[c].faceArray)
      charts.chart_of_triangle[triangle] = first_chart + static_cast<int32_t>(c);
  return charts;
}

absl::Status ApplyDensities(const std::vector<float>& factor, std::vector<chart::MeshCharts>& charts) {
  if (factor.empty()) return absl::OkStatus();
  size_t next = 0;
  for (chart::MeshCharts& mesh : charts)
    for (float& density : mesh.density) {
      if (next >= factor.size() || !(factor[next] > 0))
        return absl::InvalidArgumentError("chart_density: chart " + std::to_string(next) + " needs a factor above 0");
      density *= factor[next++];
    }
  if (next == factor.size()) return absl::OkStatus();
  return absl::InvalidArgumentError("chart_density has " + std::to_string(factor.size()) + " factors for " +
                                    std::to_string(next) + " charts");
}

// Lightmapped objects are the atlas' meshes, in order.
std::vector<int> MeshOfObject(const Scene& scene) {
  std::vector<int> meshes;
  int next = 0;
  for (const Object& object : scene.objects) meshes.push_back(object.lightmapped ? next++ : -1);
  return meshes;
}

}  // namespace

AtlasLayout ToLayout(const chart::Atlas& atlas, std::span<const int> mesh_of_object) {
  AtlasLayout layout;
  layout.texels_per_metre = atlas.texelsPerUnit;
  layout.pages.assign(atlas.atlasCount, {static_cast<int>(atlas.width), static_cast<int>(atlas.height)});
  layout.objects.resize(mesh_of_object.size());
  for (size_t o = 0; o < mesh_of_object.size(); ++o) {
    if (mesh_of_object[o] < 0) continue;
    const chart::Mesh& mesh = atlas.meshes[mesh_of_object[o]];
    layout.objects[o] = ToObjectCharts(mesh, static_cast<int32_t>(layout.charts.size()));
    for (const chart::Chart& chart : mesh.chartArray)
      layout.charts.push_back({static_cast<int>(chart.atlasIndex), static_cast<int>(o)});
  }
  return layout;
}

absl::StatusOr<AtlasLayout> GenerateCharts(const Scene& scene, const GenerateOptions& options) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<chart::MeshDecl> meshes, LightmappedMeshes(scene));
  chart::PackOptions pack = options.pack;
  const bool free_side = options.resolution <= 0 && options.texels_per_metre > 0;
  const int side = options.resolution > 0 ? options.resolution : options.max_resolution;
  pack.resolution = static_cast<uint32_t>(free_side ? 0 : side);
  pack.maxResolution = static_cast<uint32_t>(options.max_resolution);
  pack.texelsPerUnit = options.texels_per_metre;
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<chart::MeshCharts> charts, chart::ComputeCharts(meshes, options.chart));
  BAKEWELL_RETURN_IF_ERROR(ApplyDensities(options.chart_density, charts));
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, chart::PackCharts(meshes, charts, pack));
  return ToLayout(atlas, MeshOfObject(scene));
}

}  // namespace bakewell
