#include "core/scene/mean_point.h"

#include <cmath>

#include "core/base/check.h"

namespace bakewell {
namespace {

constexpr double kUnitsPerMetre = 4294967296.0;  // 2^32

}  // namespace

void MeanPoint::Add(Vec3d point_ws) {
  for (int axis = 0; axis < 3; ++axis) {
    BAKEWELL_CHECK_OP(std::abs(point_ws[axis]), <=, kCoordinateLimit_m);
    sum_[axis] += std::llround(point_ws[axis] * kUnitsPerMetre);
  }
  ++count_;
}

Vec3d MeanPoint::Value() const {
  Vec3d mean;
  if (count_ == 0) return mean;
  for (int axis = 0; axis < 3; ++axis) {
    // The whole quotient is a 63-bit integer; the remainder is below one unit and is dropped.
    mean[axis] = static_cast<double>(static_cast<int64_t>(sum_[axis] / count_)) / kUnitsPerMetre;
  }
  return mean;
}

}  // namespace bakewell
