#include "server/chart/mesh/surface.h"

#include <cmath>
#include <limits>

#include "core/base/check.h"
#include "server/chart/mesh/halfedge.h"
#include "server/chart/mesh/pairing.h"
#include "server/chart/mesh/weld.h"

namespace bakewell::chart {
namespace {

// A triangle whose area is below this share of its longest edge squared has no direction that floats can hold.
constexpr double kDegenerateShare = 5e-10;

struct Frame3 {
  Vec3d center{0, 0, 0};
  double scale = 1;
};

Frame3 FitFrame(std::span<const Vec3f> position, std::span<const uint32_t> index) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3d low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const uint32_t v : index) {
    if (!IsFinite(position[v])) continue;
    for (int c = 0; c < 3; ++c) {
      low[c] = std::min<double>(low[c], position[v][c]);
      high[c] = std::max<double>(high[c], position[v][c]);
    }
  }
  if (!(low.x <= high.x)) return {};
  const double extent = MaxComponent(high - low);
  return {(low + high) * 0.5, extent > 0 ? std::exp2(-std::ilogb(extent)) : 1.0};
}

struct Triangles {
  std::vector<std::array<uint32_t, 3>> corner;  // welded
  std::vector<uint32_t> source;
  std::vector<Vec3d> normal;
  std::vector<double> area;
};

FaceState Classify(const std::array<Vec3d, 3>& p, Vec3d& normal, double& area) {
  const Vec3d a = p[1] - p[0], b = p[2] - p[0], c = p[2] - p[1];
  normal = Cross(a, b);
  const double length = Length(normal);
  area = length / 2;
  const double longest = std::max({Dot(a, a), Dot(b, b), Dot(c, c)});
  if (!(area > kDegenerateShare * longest)) return FaceState::kDegenerate;
  normal = normal / length;
  return FaceState::kCharted;
}

Triangles UsableTriangles(std::span<const Vec3f> position, std::span<const uint32_t> index, const Frame3& frame,
                          std::vector<FaceState>& state) {
  const std::vector<uint32_t> weld = WeldPositions(position);
  Triangles result;
  for (uint32_t t = 0; t < state.size(); ++t) {
    std::array<Vec3d, 3> p;
    std::array<uint32_t, 3> corner;
    bool finite = true;
    for (int k = 0; k < 3; ++k) {
      corner[k] = weld[index[3 * t + k]];
      finite = finite && IsFinite(position[corner[k]]);
      p[k] = (ToDouble(position[corner[k]]) - frame.center) * frame.scale;
    }
    Vec3d normal;
    double area = 0;
    state[t] = finite ? Classify(p, normal, area) : FaceState::kNonFinite;
    if (state[t] != FaceState::kCharted) continue;
    result.corner.push_back(corner);
    result.source.push_back(t);
    result.normal.push_back(normal);
    result.area.push_back(area);
  }
  return result;
}

}  // namespace

Surface BuildSurface(std::span<const Vec3f> position, std::span<const uint32_t> index) {
  Surface surface;
  const Frame3 frame = FitFrame(position, index);
  surface.scale = frame.scale;
  surface.state.resize(index.size() / 3);
  Triangles triangles = UsableTriangles(position, index, frame, surface.state);

  // From a soup to half-edges.
  const auto corner = SplitNonManifold(triangles.corner, CopyRank(triangles.corner), triangles.normal);
  uint32_t vertex_count = 0;
  for (const auto& face : corner) vertex_count = std::max(vertex_count, std::max({face[0], face[1], face[2]}) + 1);
  std::vector<Vec3d> split_position(vertex_count);
  for (size_t f = 0; f < corner.size(); ++f)
    for (int k = 0; k < 3; ++k)
      split_position[corner[f][k]] = (ToDouble(position[triangles.corner[f][k]]) - frame.center) * frame.scale;
  HalfEdgeResult edges = BuildHalfEdges(corner, vertex_count);

  surface.position.reserve(edges.origin.size());
  for (const uint32_t origin : edges.origin) surface.position.push_back(split_position[origin]);
  surface.face = std::move(edges.face);
  surface.across = std::move(edges.across);
  surface.source = std::move(triangles.source);
  surface.normal = std::move(triangles.normal);
  surface.area = std::move(triangles.area);
  return surface;
}

}  // namespace bakewell::chart
