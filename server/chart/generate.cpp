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

AtlasLayout ToLayout(const Scene& scene, const chart::Atlas& atlas) {
  AtlasLayout layout;
  layout.texels_per_metre = atlas.texelsPerUnit;
  layout.pages.assign(atlas.atlasCount, {static_cast<int>(atlas.width), static_cast<int>(atlas.height)});
  layout.objects.resize(scene.objects.size());
  size_t next = 0;
  for (size_t o = 0; o < scene.objects.size(); ++o) {
    if (!scene.objects[o].lightmapped) continue;
    const chart::Mesh& mesh = atlas.meshes[next++];
    layout.objects[o] = ToObjectCharts(mesh, static_cast<int32_t>(layout.charts.size()));
    for (const chart::Chart& chart : mesh.chartArray)
      layout.charts.push_back({static_cast<int>(chart.atlasIndex), static_cast<int>(o)});
  }
  return layout;
}

}  // namespace

absl::StatusOr<AtlasLayout> GenerateCharts(const Scene& scene, const GenerateOptions& options) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<chart::MeshDecl> meshes, LightmappedMeshes(scene));
  chart::PackOptions pack = options.pack;
  pack.resolution = static_cast<uint32_t>(options.resolution > 0 ? options.resolution : options.max_resolution);
  pack.texelsPerUnit = options.texels_per_metre;
  BAKEWELL_ASSIGN_OR_RETURN(const chart::Atlas atlas, chart::Generate(meshes, options.chart, pack));
  return ToLayout(scene, atlas);
}

}  // namespace bakewell
