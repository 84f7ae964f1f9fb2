#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// A face of a chart laid into its own plane, and what its edges weigh: cotangent k is that of the angle opposite the
// edge from corner k to corner k+1, halved (Pinkall & Polthier 1993).
struct PlanarFace {
  std::array<Vec2d, 3> corner;
  std::array<double, 3> half_cotangent;
};

std::vector<PlanarFace> PlanarFaces(const Surface& surface, const FlatChart& chart);

// One entry of a symmetric matrix' lower triangle.
using Entries = std::vector<Eigen::Triplet<double>>;

// Adds weight * (x_i - x_j)^2 to a quadratic form whose matrix is given by its lower triangle.
void AddSquaredDifference(Entries& entries, int i, int j, double weight);

}  // namespace bakewell::chart
