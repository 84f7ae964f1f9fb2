#include "tests/unit/chart/shapes.h"

#include <cmath>

namespace bakewell::chart {
namespace {

// columns x rows quads of a grid of (columns + 1) * (rows + 1) vertices that starts at vertex `base`.
void AddGridFaces(int columns, int rows, uint32_t base, Soup& soup) {
  const auto at = [&](int x, int y) { return base + static_cast<uint32_t>(y * (columns + 1) + x); };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x)
      soup.index.insert(soup.index.end(),
                        {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y), at(x + 1, y + 1), at(x, y + 1)});
}

}  // namespace

Soup Box() {
  Soup soup;
  for (int axis = 0; axis < 3; ++axis)
    for (int end = 0; end < 2; ++end) {
      const uint32_t base = static_cast<uint32_t>(soup.position.size());
      for (int v = 0; v < 2; ++v)
        for (int u = 0; u < 2; ++u) {
          Vec3f p;
          p[axis] = static_cast<float>(end);
          p[(axis + (end == 1 ? 1 : 2)) % 3] = static_cast<float>(u);
          p[(axis + (end == 1 ? 2 : 1)) % 3] = static_cast<float>(v);
          soup.position.push_back(p);
        }
      AddGridFaces(1, 1, base, soup);
    }
  return soup;
}

Soup CylinderWall(int segments, double turn) {
  Soup soup;
  for (int y = 0; y <= 4; ++y)
    for (int x = 0; x <= segments; ++x) {
      const double a = turn * x / segments;
      soup.position.push_back(ToFloat({std::cos(a), 0.5 * y, -std::sin(a)}));
    }
  AddGridFaces(segments, 4, 0, soup);
  return soup;
}

Soup Sphere(int n, double height) {
  Soup soup;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= 2 * n; ++x) {
      const double t = kPi * y / n, p = kPi * (x % (2 * n)) / n;
      soup.position.push_back(ToFloat({std::sin(t) * std::cos(p), -height * std::cos(t), -std::sin(t) * std::sin(p)}));
    }
  AddGridFaces(2 * n, n, 0, soup);
  return soup;
}

}  // namespace bakewell::chart
