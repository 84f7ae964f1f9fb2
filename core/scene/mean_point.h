#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace bakewell {

// The mean of points in world metres, exact and so independent of their order: each coordinate is rounded to 2^-32 m
// and summed as a 128-bit integer. Coordinates must be finite and within kCoordinateLimit_m; 2^63 points fit.
class MeanPoint {
 public:
  static constexpr double kCoordinateLimit_m = 1e9;

  void Add(Vec3d point_ws);
  // Zero where nothing was added.
  Vec3d Value() const;

 private:
  __extension__ using Int128 = __int128;
  Int128 sum_[3] = {0, 0, 0};
  int64_t count_ = 0;
};

}  // namespace bakewell
