#include "server/chart/atlas.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "server/chart/pack/orient.h"
#include "server/chart/pack/pack.h"
#include "server/chart/rounding.h"

namespace bakewell::chart {
namespace {

// An outline whose area is this close to its bounding box's is a rectangle.
constexpr double kRectangleShare = 1e-5;

struct ChartRef {
  uint32_t mesh, chart;
};

// A chart's own plane, turned upright and moved to the corner, in input units.
struct Upright {
  Vec2d axis{1, 0}, low{0, 0};
  double units = 1;  // input units per scaled unit
  Vec2d operator()(Vec2d p) const {
    return Vec2d{p.x * axis.x + p.y * axis.y, p.y * axis.x - p.x * axis.y} * units - low;
  }
};

struct Prepared {
  PackItem item;
  Upright upright;
};

Prepared Prepare(const MeshCharts& mesh, uint32_t c, bool to_axis) {
  const FlatChart& chart = mesh.charts[c];
  Prepared prepared;
  for (const auto& [a, b, unused] : BoundaryEdges(mesh.surface, chart))
    prepared.item.outline.push_back({chart.uv[a], chart.uv[b]});
  Upright& upright = prepared.upright;
  upright.units = 1 / mesh.surface.scale;
  if (to_axis) upright.axis = LeastRectangleAxis(prepared.item.outline);
  Vec2d low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  for (const Vec2d uv : chart.uv) {
    const Vec2d p = upright(uv);
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  upright.low = low;
  for (Segment2& segment : prepared.item.outline) segment = {upright(segment[0]), upright(segment[1])};
  prepared.item.size = high - low;
  for (const uint32_t f : chart.face) prepared.item.area += mesh.surface.area[f] * upright.units * upright.units;
  prepared.item.density = mesh.density[c];
  const double box = prepared.item.size.x * prepared.item.size.y;
  prepared.item.rectangle = std::abs(prepared.item.area - box) <= kRectangleShare * box;
  return prepared;
}

// Builds one output mesh chart by chart.
class MeshWriter {
 public:
  MeshWriter(const MeshDecl& decl, const MeshCharts& charts) : decl_(decl), charts_(charts) {
    mesh_.indexArray.resize(decl.indexData.size());
    mesh_.faceState = charts.surface.state;
  }

  void AddChart(uint32_t c, const Upright& upright, const Placement& placement, Vec2d page) {
    const FlatChart& flat = charts_.charts[c];
    Chart chart;
    chart.atlasIndex = static_cast<uint32_t>(placement.page);
    std::vector<Vec2d> position;
    for (const Vec2d uv : flat.uv) position.push_back(ToPage(placement, upright(uv)));
    const std::vector<TexelUv> rounded = RoundToFloat(flat.corner, position, page);
    const std::vector<Use> uses = VertexUses(flat);
    const uint32_t base = static_cast<uint32_t>(mesh_.vertexArray.size());
    for (const Use& use : uses) {
      const TexelUv uv = rounded[use.local];
      mesh_.vertexArray.push_back({placement.page, static_cast<int32_t>(c), {uv.x, uv.y}, use.source});
    }
    for (size_t i = 0; i < flat.face.size(); ++i) {
      const uint32_t triangle = charts_.surface.source[flat.face[i]];
      chart.faceArray.push_back(triangle);
      for (int k = 0; k < 3; ++k) {
        const Use use{flat.corner[i][k], decl_.indexData[3 * triangle + k]};
        const auto it = std::lower_bound(uses.begin(), uses.end(), use);
        mesh_.indexArray[3 * triangle + k] = base + static_cast<uint32_t>(it - uses.begin());
      }
    }
    mesh_.chartArray.push_back(std::move(chart));
  }

  // Triangles without a chart collapse to a point: where one of their vertices is charted, there.
  Mesh Finish() && {
    std::vector<uint32_t> anchor(decl_.vertexPositionData.size(), kNone);
    for (uint32_t v = 0; v < mesh_.vertexArray.size(); ++v) anchor[mesh_.vertexArray[v].xref] = v;
    for (uint32_t t = 0; t < mesh_.faceState.size(); ++t) {
      if (mesh_.faceState[t] == FaceState::kCharted) continue;
      Vertex point;
      for (int k = 0; k < 3; ++k)
        if (const uint32_t v = anchor[decl_.indexData[3 * t + k]]; v != kNone)
          std::copy_n(mesh_.vertexArray[v].uv, 2, point.uv);
      for (int k = 0; k < 3; ++k) {
        point.xref = decl_.indexData[3 * t + k];
        mesh_.indexArray[3 * t + k] = static_cast<uint32_t>(mesh_.vertexArray.size());
        mesh_.vertexArray.push_back(point);
      }
    }
    return std::move(mesh_);
  }

 private:
  struct Use {
    uint32_t local, source;
    auto operator<=>(const Use&) const = default;
  };

  std::vector<Use> VertexUses(const FlatChart& flat) const {
    std::vector<Use> uses;
    for (size_t i = 0; i < flat.face.size(); ++i)
      for (int k = 0; k < 3; ++k)
        uses.push_back({flat.corner[i][k], decl_.indexData[3 * charts_.surface.source[flat.face[i]] + k]});
    std::sort(uses.begin(), uses.end());
    uses.erase(std::unique(uses.begin(), uses.end()), uses.end());
    return uses;
  }

  const MeshDecl& decl_;
  const MeshCharts& charts_;
  Mesh mesh_;
};

absl::Status CheckOptions(const PackOptions& options) {
  if (options.resolution > 8192) return absl::InvalidArgumentError("resolution must not be above 8192");
  if (options.resolution > 0 && options.resolution < 16)
    return absl::InvalidArgumentError("resolution must be 0 or at least 16");
  if (options.maxResolution > 8192 || (options.maxResolution > 0 && options.maxResolution < 16))
    return absl::InvalidArgumentError("maxResolution must be 0 or 16 to 8192");
  if (options.padding > 256) return absl::InvalidArgumentError("padding must not be above 256");
  if (!(options.texelsPerUnit >= 0)) return absl::InvalidArgumentError("texelsPerUnit must not be negative");
  return absl::OkStatus();
}

std::vector<ChartRef> AllCharts(std::span<const MeshCharts> charts) {
  std::vector<ChartRef> refs;
  for (uint32_t m = 0; m < charts.size(); ++m)
    for (uint32_t c = 0; c < charts[m].charts.size(); ++c) refs.push_back({m, c});
  return refs;
}

Atlas Assemble(std::span<const MeshDecl> meshes, std::span<const MeshCharts> charts, std::span<const ChartRef> refs,
               const std::vector<Prepared>& prepared, const PackResult& packed) {
  Atlas atlas;
  atlas.width = static_cast<uint32_t>(packed.width);
  atlas.height = static_cast<uint32_t>(packed.height);
  atlas.atlasCount = static_cast<uint32_t>(packed.pages);
  atlas.chartCount = static_cast<uint32_t>(refs.size());
  atlas.texelsPerUnit = static_cast<float>(packed.texels_per_unit);
  atlas.utilization.assign(packed.utilization.begin(), packed.utilization.end());
  std::vector<size_t> first(charts.size() + 1, 0);
  for (size_t m = 0; m < charts.size(); ++m) first[m + 1] = first[m] + charts[m].charts.size();
  atlas.meshes.resize(meshes.size());
  tbb::parallel_for(size_t{0}, meshes.size(), [&](size_t m) {
    MeshWriter writer(meshes[m], charts[m]);
    for (uint32_t c = 0; c < charts[m].charts.size(); ++c)
      writer.AddChart(c, prepared[first[m] + c].upright, packed.placement[first[m] + c],
                      {double(packed.width), double(packed.height)});
    atlas.meshes[m] = std::move(writer).Finish();
  });
  return atlas;
}

}  // namespace

absl::StatusOr<Atlas> PackCharts(std::span<const MeshDecl> meshes, std::span<const MeshCharts> charts,
                                 const PackOptions& options) {
  BAKEWELL_RETURN_IF_ERROR(CheckOptions(options));
  BAKEWELL_CHECK_OP(meshes.size(), ==, charts.size());
  const std::vector<ChartRef> refs = AllCharts(charts);
  std::vector<Prepared> prepared(refs.size());
  tbb::parallel_for(size_t{0}, refs.size(), [&](size_t i) {
    prepared[i] = Prepare(charts[refs[i].mesh], refs[i].chart, options.rotateChartsToAxis);
  });
  std::vector<PackItem> items;
  for (const Prepared& p : prepared) items.push_back(p.item);
  PackResult packed;
  if (!items.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(packed, Pack(items, options));
  }
  return Assemble(meshes, charts, refs, prepared, packed);
}

}  // namespace bakewell::chart
