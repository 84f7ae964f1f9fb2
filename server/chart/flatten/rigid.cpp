#include "server/chart/flatten/rigid.h"

#include <Eigen/SparseCholesky>
#include <cmath>

#include "server/chart/flatten/laplacian.h"
#include "server/chart/flatten/stretch.h"

namespace bakewell::chart {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Points = Eigen::MatrixX2d;

constexpr int kMaxSteps = 32;
// A step that takes less than this share of what is left above isometry is the last.
constexpr double kLeastGain = 0.005;
// A step goes at most this share of the way to the first face that would collapse.
constexpr double kSafeShare = 0.9;

Matrix Laplacian(const FlatChart& chart, const std::vector<PlanarFace>& faces) {
  Entries entries;
  entries.reserve(9 * faces.size() + 1);
  for (size_t i = 0; i < faces.size(); ++i)
    for (int k = 0; k < 3; ++k)
      AddSquaredDifference(entries, static_cast<int>(chart.corner[i][k]),
                           static_cast<int>(chart.corner[i][(k + 1) % 3]), faces[i].half_cotangent[k]);
  // The energy does not see a translation: one vertex is tied down.
  entries.emplace_back(0, 0, 1.0);
  const int n = static_cast<int>(chart.vertex.size());
  Matrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

// The right-hand side for the rotations that fit the present map best.
Points RotatedEdges(const FlatChart& chart, const std::vector<PlanarFace>& faces) {
  Points rhs = Points::Zero(static_cast<Eigen::Index>(chart.vertex.size()), 2);
  for (size_t i = 0; i < faces.size(); ++i) {
    const PlanarFace& face = faces[i];
    double along = 0, across = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec2d x = face.corner[(k + 1) % 3] - face.corner[k];
      const Vec2d u = chart.uv[chart.corner[i][(k + 1) % 3]] - chart.uv[chart.corner[i][k]];
      along += face.half_cotangent[k] * (u.x * x.x + u.y * x.y);
      across += face.half_cotangent[k] * (u.y * x.x - u.x * x.y);
    }
    const double length = std::hypot(along, across);
    const double c = length > 0 ? along / length : 1, s = length > 0 ? across / length : 0;
    for (int k = 0; k < 3; ++k) {
      const Vec2d x = face.corner[(k + 1) % 3] - face.corner[k];
      const Eigen::RowVector2d turned(face.half_cotangent[k] * (c * x.x - s * x.y),
                                      face.half_cotangent[k] * (s * x.x + c * x.y));
      rhs.row(chart.corner[i][(k + 1) % 3]) += turned;
      rhs.row(chart.corner[i][k]) -= turned;
    }
  }
  return rhs;
}

// The least t > 0 at which a face whose corners move by d collapses, or infinity (Smith & Schaefer 2015, section 3.3).
double CollapseTime(Vec2d u, Vec2d v, Vec2d du, Vec2d dv) {
  const double a = Cross(du, dv), b = Cross(u, dv) + Cross(du, v), c = Cross(u, v);
  if (c <= 0) return INFINITY;
  const double root = b * b - 4 * a * c;
  if (root < 0) return INFINITY;
  // The numerically safe pair of roots.
  const double q = -0.5 * (b + std::copysign(std::sqrt(root), b));
  double least = INFINITY;
  for (const double t : {a != 0 ? q / a : INFINITY, q != 0 ? c / q : INFINITY})
    if (t > 0) least = std::min(least, t);
  return least;
}

double SafeStep(const FlatChart& chart, const std::vector<Vec2d>& move) {
  double step = INFINITY;
  for (const auto& [a, b, c] : chart.corner)
    step = std::min(
        step, CollapseTime(chart.uv[b] - chart.uv[a], chart.uv[c] - chart.uv[a], move[b] - move[a], move[c] - move[a]));
  return std::min(1.0, kSafeShare * step);
}

}  // namespace

void MakeRigid(const Surface& surface, FlatChart& chart) {
  const std::vector<PlanarFace> faces = PlanarFaces(surface, chart);
  const Eigen::SimplicialLDLT<Matrix> solver(Laplacian(chart, faces));
  if (solver.info() != Eigen::Success) return;

  std::vector<Vec2d> best = chart.uv, move(chart.uv.size());
  double least = MeasureStretch(surface, chart).l2;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Points rhs = RotatedEdges(chart, faces);
    const Points target = solver.solve(rhs);
    if (!target.allFinite()) break;
    for (size_t v = 0; v < move.size(); ++v) move[v] = Vec2d{target(v, 0), target(v, 1)} - chart.uv[v];
    const double share = SafeStep(chart, move);
    for (size_t v = 0; v < move.size(); ++v) chart.uv[v] = chart.uv[v] + move[v] * share;
    const double now = MeasureStretch(surface, chart).l2;
    const bool done = now < least && (least - now) < kLeastGain * (least - 1);
    if (now < least) least = now, best = chart.uv;
    if (done || share < 1e-3) break;
  }
  chart.uv = std::move(best);
}

}  // namespace bakewell::chart
