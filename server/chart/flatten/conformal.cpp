#include "server/chart/flatten/conformal.h"

#include <Eigen/SparseCholesky>

#include "server/chart/flatten/laplacian.h"

namespace bakewell::chart {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// Of boundary vertices whose squared distances differ by less than this share the first counts as farthest, whatever
// rounding says.
constexpr double kFartherShare = 1e-4;

// The boundary vertex farthest from a vertex in space.
uint32_t FarthestFrom(const Surface& surface, const FlatChart& chart, const std::vector<BoundaryEdge>& boundary,
                      uint32_t from) {
  uint32_t best = from;
  double farthest = 0;
  for (const auto& edge : boundary) {
    const Vec3d d = surface.position[chart.vertex[edge.a]] - surface.position[chart.vertex[from]];
    if (Dot(d, d) > farthest * (1 + kFartherShare)) farthest = Dot(d, d), best = edge.a;
  }
  return best;
}

// u of vertex v is unknown 2 v, v of it 2 v + 1. Area of the outline: half the sum over boundary edges of u x v.
Entries ConformalEnergy(const Surface& surface, const FlatChart& chart, const std::vector<BoundaryEdge>& boundary) {
  Entries entries;
  const std::vector<PlanarFace> faces = PlanarFaces(surface, chart);
  for (size_t i = 0; i < faces.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const int a = static_cast<int>(chart.corner[i][k]), b = static_cast<int>(chart.corner[i][(k + 1) % 3]);
      for (int c = 0; c < 2; ++c) AddSquaredDifference(entries, 2 * a + c, 2 * b + c, faces[i].half_cotangent[k]);
    }
  // |d|^2 / 2 - area, doubled: the entry of u_a v_b is -1/2, that of v_a u_b +1/2.
  for (const auto& edge : boundary) {
    const int a = static_cast<int>(edge.a), b = static_cast<int>(edge.b);
    entries.emplace_back(std::max(2 * a, 2 * b + 1), std::min(2 * a, 2 * b + 1), -0.5);
    entries.emplace_back(std::max(2 * a + 1, 2 * b), std::min(2 * a + 1, 2 * b), 0.5);
  }
  return entries;
}

// Moves the held unknowns to the right-hand side and leaves the others numbered in order.
struct Reduced {
  Matrix matrix;
  Eigen::VectorXd rhs;
};

Reduced Reduce(const Entries& entries, const std::vector<int>& number, const Eigen::VectorXd& held, int unknowns) {
  Reduced system;
  Entries kept;
  system.rhs = Eigen::VectorXd::Zero(unknowns);
  for (const auto& e : entries) {
    const int row = number[e.row()], col = number[e.col()];
    if (row >= 0 && col >= 0) kept.emplace_back(row, col, e.value());
    if (row >= 0 && col < 0) system.rhs[row] -= e.value() * held[e.col()];
    if (row < 0 && col >= 0) system.rhs[col] -= e.value() * held[e.row()];
  }
  system.matrix.resize(unknowns, unknowns);
  system.matrix.setFromTriplets(kept.begin(), kept.end());
  return system;
}

}  // namespace

bool MapConformally(const Surface& surface, FlatChart& chart) {
  const auto boundary = BoundaryEdges(surface, chart);
  if (boundary.empty()) return false;
  const uint32_t a = FarthestFrom(surface, chart, boundary, boundary[0].a),
                 b = FarthestFrom(surface, chart, boundary, a);
  if (a == b) return false;

  // a lies at the origin, b on the u axis.
  const int count = static_cast<int>(2 * chart.vertex.size());
  Eigen::VectorXd value = Eigen::VectorXd::Zero(count);
  value[2 * b] = Length(surface.position[chart.vertex[b]] - surface.position[chart.vertex[a]]);
  std::vector<int> number(count, -1);
  int unknowns = 0;
  for (int i = 0; i < count; ++i)
    if (i / 2 != static_cast<int>(a) && i / 2 != static_cast<int>(b)) number[i] = unknowns++;

  const Reduced system = Reduce(ConformalEnergy(surface, chart, boundary), number, value, unknowns);
  const Eigen::SimplicialLDLT<Matrix> solver(system.matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = solver.solve(system.rhs);
  if (!solution.allFinite()) return false;
  for (int i = 0; i < count; ++i)
    if (number[i] >= 0) value[i] = solution[number[i]];
  for (size_t v = 0; v < chart.uv.size(); ++v) chart.uv[v] = {value[2 * v], value[2 * v + 1]};
  return true;
}

}  // namespace bakewell::chart
