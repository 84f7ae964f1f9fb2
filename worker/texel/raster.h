#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/vec.h"

namespace bakewell {

// A convex polygon with up to 8 corners (a triangle cut by a square has at most 7).
struct ConvexPolygon {
  int count = 0;
  std::array<Vec2d, 8> corner;

  double SignedArea() const {
    double area = 0;
    for (int i = 1; i + 1 < count; ++i) area += Cross(corner[i] - corner[0], corner[i + 1] - corner[0]);
    return 0.5 * area;
  }
};

// The part of a polygon where sign * (coordinate - limit) >= 0, coordinate being x (axis 0) or y (axis 1).
inline ConvexPolygon ClipHalfPlane(const ConvexPolygon& polygon, int axis, double limit, double sign) {
  const auto side = [&](const Vec2d& p) { return sign * ((axis == 0 ? p.x : p.y) - limit); };
  ConvexPolygon out;
  for (int i = 0; i < polygon.count; ++i) {
    const Vec2d a = polygon.corner[i], b = polygon.corner[i + 1 == polygon.count ? 0 : i + 1];
    const double da = side(a), db = side(b);
    if (da >= 0 && out.count < 8) out.corner[out.count++] = a;
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      Vec2d cut = a + (b - a) * (da / (da - db));
      (axis == 0 ? cut.x : cut.y) = limit;
      if (out.count < 8) out.corner[out.count++] = cut;
    }
  }
  return out;
}

// The part of a triangle inside the square of side `side` whose least corner is `corner`.
inline ConvexPolygon ClipToSquare(const ConvexPolygon& triangle, Vec2d corner, double side) {
  ConvexPolygon part = ClipHalfPlane(triangle, 1, corner.y, 1);
  part = ClipHalfPlane(part, 1, corner.y + side, -1);
  part = ClipHalfPlane(part, 0, corner.x, 1);
  return ClipHalfPlane(part, 0, corner.x + side, -1);
}

// Calls visit(x, y, polygon) for every cell of the grid [0, width) x [0, height) that the triangle covers with an area
// above zero, with the exact part inside the cell. Row by row, so the cost is that of the cells, not of the bounding
// box.
template <typename Visit>
void RasterizeExact(Vec2d a, Vec2d b, Vec2d c, int width, int height, Visit visit) {
  const ConvexPolygon triangle{3, {a, b, c}};
  const auto range = [](const ConvexPolygon& p, bool along_x, int size) {
    double low = 1e300, high = -1e300;
    for (int i = 0; i < p.count; ++i) {
      const double v = along_x ? p.corner[i].x : p.corner[i].y;
      low = std::min(low, v);
      high = std::max(high, v);
    }
    const double limit = size;
    return std::pair<int, int>{static_cast<int>(std::floor(std::clamp(low, 0.0, limit))),
                               static_cast<int>(std::ceil(std::clamp(high, 0.0, limit)))};
  };
  const auto [y_begin, y_end] = range(triangle, false, height);
  for (int y = y_begin; y < y_end; ++y) {
    const ConvexPolygon row = ClipHalfPlane(ClipHalfPlane(triangle, 1, y, 1), 1, y + 1, -1);
    if (row.count < 3) continue;
    const auto [x_begin, x_end] = range(row, true, width);
    for (int x = x_begin; x < x_end; ++x) {
      const ConvexPolygon cell = ClipHalfPlane(ClipHalfPlane(row, 0, x, 1), 0, x + 1, -1);
      if (cell.count >= 3 && cell.SignedArea() != 0) visit(x, y, cell);
    }
  }
}

}  // namespace bakewell
