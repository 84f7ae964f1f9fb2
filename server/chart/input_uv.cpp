#include "server/chart/input_uv.h"

#include <cmath>

#include "server/chart/flatten/overlap.h"
#include "server/chart/flatten/stretch.h"

namespace bakewell::chart {
namespace {

// The UV of corner k of face f.
Vec2f UvOf(const Surface& surface, const InputUv& input, uint32_t f, int k) {
  return input.uv[input.index[3 * surface.source[f] + k]];
}

// The UV that face g has at vertex v.
Vec2f UvAt(const Surface& surface, const InputUv& input, uint32_t g, uint32_t v) {
  const auto& corner = surface.face[g];
  return UvOf(surface, input, g, corner[0] == v ? 0 : corner[1] == v ? 1 : 2);
}

}  // namespace

std::vector<uint8_t> InputSeams(const Surface& surface, const InputUv& input) {
  std::vector<uint8_t> seam(3 * surface.face.size(), 0);
  for (uint32_t f = 0; f < surface.FaceCount(); ++f)
    for (int k = 0; k < 3; ++k) {
      const uint32_t g = surface.across[f][k];
      if (g == kNone) continue;
      for (const int c : {k, (k + 1) % 3})
        if (!(UvOf(surface, input, f, c) == UvAt(surface, input, g, surface.face[f][c]))) seam[3 * f + k] = 1;
    }
  return seam;
}

void CutAlong(std::span<const uint8_t> seam, Surface& surface) {
  for (uint32_t f = 0; f < surface.FaceCount(); ++f)
    for (int k = 0; k < 3; ++k)
      if (seam[3 * f + k]) surface.across[f][k] = kNone;
}

std::optional<FlatChart> ChartFromInput(const Surface& surface, std::span<const uint32_t> faces, const InputUv& input) {
  FlatChart chart = LocalChart(surface, faces);
  double area2 = 0;
  for (uint32_t i = 0; i < faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec2f uv = UvOf(surface, input, faces[i], k);
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return std::nullopt;
      chart.uv[chart.corner[i][k]] = {uv.x, uv.y};
    }
    area2 += SignedArea2(chart, i);
  }
  if (area2 < 0)
    for (Vec2d& uv : chart.uv) uv.x = -uv.x;
  if (!FindConflicts(surface, chart).None()) return std::nullopt;
  NormalizeArea(surface, chart);
  return chart;
}

}  // namespace bakewell::chart
