#include <tbb/parallel_for.h>

#include <numeric>

#include "server/chart/atlas.h"
#include "server/chart/flatten/flatten.h"
#include "server/chart/flatten/stretch.h"
#include "server/chart/input_uv.h"
#include "server/chart/pack/orient.h"
#include "server/chart/segment/relax.h"
#include "server/chart/segment/segment.h"

namespace bakewell::chart {
namespace {

constexpr uint32_t kMaxComparedFaces = 150000;
// A chart may stretch (l2 - 1) this many times as much as its mesh does on average, or this share of maxStretch - 1.
constexpr double kMaxStretchOfMean = 5, kFreeStretchShare = 0.25;
constexpr double kLeastFillGain = 0.02, kMaxMoreCharts = 1.25;

absl::Status CheckIndices(std::span<const MeshDecl> meshes) {
  for (size_t m = 0; m < meshes.size(); ++m) {
    const MeshDecl& mesh = meshes[m];
    const std::string name = "mesh " + std::to_string(m);
    if (mesh.indexData.size() % 3 != 0)
      return absl::InvalidArgumentError(name + ": index count is not a multiple of 3");
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

std::vector<FlatChart> FlattenEach(const Surface& surface, const std::vector<std::vector<uint32_t>>& segments,
                                   const ChartOptions& options) {
  std::vector<std::vector<FlatChart>> flat(segments.size());
  tbb::parallel_for(size_t{0}, segments.size(), [&](size_t i) { flat[i] = Flatten(surface, segments[i], options); });
  std::vector<FlatChart> charts;
  for (auto& part : flat)
    for (FlatChart& chart : part) charts.push_back(std::move(chart));
  return charts;
}

// Area-weighted mean of l2 - 1.
double MeanStretch(const Surface& surface, std::span<const FlatChart> charts, std::span<const double> excess) {
  double sum = 0, area = 0;
  for (size_t i = 0; i < charts.size(); ++i)
    for (const uint32_t f : charts[i].face) sum += surface.area[f] * excess[i], area += surface.area[f];
  return area > 0 ? sum / area : 0;
}

// Where most of a mesh is flat, a few curved charts at the bound make up its stretch: they are cut up.
std::vector<FlatChart> FlattenAll(const Surface& surface, const std::vector<uint32_t>& label,
                                  const ChartOptions& options) {
  std::vector<FlatChart> charts = FlattenEach(surface, FacesOf(label), options);
  std::vector<double> excess(charts.size());
  tbb::parallel_for(size_t{0}, charts.size(), [&](size_t i) { excess[i] = MeasureStretch(surface, charts[i]).l2 - 1; });
  ChartOptions tighter = options;
  const double limit = std::max(kMaxStretchOfMean * MeanStretch(surface, charts, excess),
                                kFreeStretchShare * (double{options.maxStretch} - 1));
  tighter.maxStretch = static_cast<float>(1 + limit);
  std::vector<std::vector<uint32_t>> stretched;
  for (size_t i = 0; i < charts.size(); ++i)
    if (excess[i] > limit) stretched.push_back(std::move(charts[i].face));
  std::erase_if(charts, [](const FlatChart& chart) { return chart.face.empty(); });
  for (FlatChart& chart : FlattenEach(surface, stretched, tighter)) charts.push_back(std::move(chart));
  return charts;
}

// Share of the charts' least bounding rectangles that they fill: what a packer can make of them.
double RectangleFill(const Surface& surface, std::span<const FlatChart> charts) {
  double area = 0, rectangles = 0;
  for (const FlatChart& chart : charts) {
    std::vector<Segment2> outline;
    for (const BoundaryEdge& edge : BoundaryEdges(surface, chart))
      outline.push_back({chart.uv[edge.a], chart.uv[edge.b]});
    for (const uint32_t f : chart.face) area += surface.area[f];
    const Vec2d size = SizeAlong(outline, LeastRectangleAxis(outline));
    rectangles += size.x * size.y;
  }
  return rectangles > 0 ? area / rectangles : 1;
}

// Relaxed charts are rounder, but where a surface has features their borders leave those: both are laid out and the
// better fill wins, if it does not cost charts. Above kMaxComparedFaces only the relaxed ones.
std::vector<FlatChart> GrowCharts(const Surface& surface, std::span<const uint8_t> seam, const ChartOptions& options) {
  const std::vector<uint32_t> grown = Segment(surface, options, seam);
  std::vector<uint32_t> relaxed = grown;
  for (uint32_t i = 0; i < options.maxIterations; ++i) relaxed = RelaxOnce(surface, relaxed);
  if (options.maxIterations > 0) CutTeeth(surface, relaxed);
  std::vector<FlatChart> charts = FlattenAll(surface, relaxed, options);
  if (relaxed == grown || surface.FaceCount() > kMaxComparedFaces) return charts;
  std::vector<FlatChart> plain = FlattenAll(surface, grown, options);
  const double gain = RectangleFill(surface, charts) - RectangleFill(surface, plain);
  const bool keep = gain > kLeastFillGain && double(charts.size()) <= kMaxMoreCharts * double(plain.size()) + 1;
  return keep ? charts : plain;
}

// The input's own charts; what is not valid of them is charted anew.
std::vector<FlatChart> KeepInputCharts(const Surface& surface, const InputUv& input, const ChartOptions& options) {
  std::vector<uint32_t> all(surface.FaceCount());
  std::iota(all.begin(), all.end(), 0u);
  std::vector<FlatChart> charts;
  for (const auto& part : ConnectedParts(surface, all)) {
    if (auto chart = ChartFromInput(surface, part, input)) {
      charts.push_back(*std::move(chart));
      continue;
    }
    for (FlatChart& chart : Flatten(surface, part, options)) charts.push_back(std::move(chart));
  }
  return charts;
}

MeshCharts ChartMesh(const MeshDecl& mesh, const ChartOptions& options) {
  MeshCharts result;
  result.surface = BuildSurface(mesh.vertexPositionData, mesh.indexData);
  std::vector<uint8_t> seam;
  const InputUv input{mesh.vertexUvData, mesh.indexData};
  if (!mesh.vertexUvData.empty()) seam = InputSeams(result.surface, input);
  if (options.useInputMeshUvs && !seam.empty()) {
    CutAlong(seam, result.surface);
    result.charts = KeepInputCharts(result.surface, input, options);
  } else {
    result.charts = GrowCharts(result.surface, seam, options);
  }
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
