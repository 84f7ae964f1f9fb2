#include <tbb/parallel_for.h>

#include "server/chart/atlas.h"
#include "server/chart/flatten/flatten.h"
#include "server/chart/segment/segment.h"

namespace bakewell::chart {
namespace {

absl::Status CheckIndices(std::span<const MeshDecl> meshes) {
  for (size_t m = 0; m < meshes.size(); ++m) {
    const MeshDecl& mesh = meshes[m];
    const std::string name = "mesh " + std::to_string(m);
    if (mesh.indexData.size() % 3 != 0) return absl::InvalidArgumentError(name + ": index count is not a multiple of 3");
    if (!mesh.vertexUvData.empty() && mesh.vertexUvData.size() != mesh.vertexPositionData.size())
      return absl::InvalidArgumentError(name + ": as many UVs as positions are needed");
    if (!(mesh.density > 0)) return absl::InvalidArgumentError(name + ": density must be above 0");
    for (size_t i = 0; i < mesh.indexData.size(); ++i)
      if (mesh.indexData[i] >= mesh.vertexPositionData.size())
        return absl::InvalidArgumentError(name + ": index " + std::to_string(i) + " is " +
                                          std::to_string(mesh.indexData[i]) + ", beyond its vertices");
  }
  return absl::OkStatus();
}

// The faces of each segment, ascending.
std::vector<std::vector<uint32_t>> FacesOf(const std::vector<uint32_t>& label) {
  std::vector<std::vector<uint32_t>> faces;
  for (uint32_t f = 0; f < label.size(); ++f) {
    if (label[f] >= faces.size()) faces.resize(label[f] + 1);
    faces[label[f]].push_back(f);
  }
  return faces;
}

MeshCharts ChartMesh(const MeshDecl& mesh, const ChartOptions& options) {
  MeshCharts result;
  result.surface = BuildSurface(mesh.vertexPositionData, mesh.indexData);
  const auto segments = FacesOf(Segment(result.surface, options));
  std::vector<std::vector<FlatChart>> flat(segments.size());
  tbb::parallel_for(size_t{0}, segments.size(),
                    [&](size_t i) { flat[i] = Flatten(result.surface, segments[i], options); });
  for (auto& charts : flat)
    for (FlatChart& chart : charts) result.charts.push_back(std::move(chart));
  result.density.assign(result.charts.size(), mesh.density);
  return result;
}

}  // namespace

absl::StatusOr<std::vector<MeshCharts>> ComputeCharts(std::span<const MeshDecl> meshes, const ChartOptions& options) {
  BAKEWELL_RETURN_IF_ERROR(CheckIndices(meshes));
  std::vector<MeshCharts> result(meshes.size());
  tbb::parallel_for(size_t{0}, meshes.size(), [&](size_t m) { result[m] = ChartMesh(meshes[m], options); });
  return result;
}

absl::StatusOr<Atlas> Generate(std::span<const MeshDecl> meshes, const ChartOptions& chart_options,
                               const PackOptions& pack_options) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<MeshCharts> charts, ComputeCharts(meshes, chart_options));
  return PackCharts(meshes, charts, pack_options);
}

}  // namespace bakewell::chart
