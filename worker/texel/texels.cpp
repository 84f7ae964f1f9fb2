#include "worker/texel/texels.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "core/base/check.h"
#include "worker/texel/raster.h"

namespace bakewell {
namespace {

// One clipped piece as it comes out of the rasteriser.
struct Piece {
  int32_t page, tile, y, x;
  int32_t chart;
  uint32_t triangle;
  double coverage;
  Vec2d centroid;  // [texels]

  auto Place() const { return std::tuple(page, tile, y, x); }
  auto Order() const { return std::tuple(page, tile, y, x, triangle); }
};

Vec2d Centroid(const ConvexPolygon& p) {
  Vec2d sum;
  double area = 0;
  for (int i = 1; i + 1 < p.count; ++i) {
    const double a = std::fabs(Cross(p.corner[i] - p.corner[0], p.corner[i + 1] - p.corner[0]));
    sum = sum + (p.corner[0] + p.corner[i] + p.corner[i + 1]) * (a / 3);
    area += a;
  }
  return area > 0 ? sum * (1 / area) : p.corner[0];
}

int TileOf(int x, int y, int width) { return (y / kTileSide) * ((width + kTileSide - 1) / kTileSide) + x / kTileSide; }

int32_t ChartOf(const World& world, const AtlasLayout& layout, uint32_t triangle) {
  const Triangle& t = world.triangles()[triangle];
  const ObjectCharts& charts = layout.objects[t.object];
  return charts.index.empty() ? kNoChart : charts.chart_of_triangle[t.index_in_object];
}

std::vector<Piece> ClipAll(const World& world, const AtlasLayout& layout, int only_page) {
  std::vector<Piece> pieces;
  for (uint32_t k = 0; k < world.triangles().size(); ++k) {
    const int32_t chart = ChartOf(world, layout, k);
    if (chart == kNoChart) continue;
    const int page = layout.charts[chart].page;
    if (only_page != kAllPages && page != only_page) continue;
    const PageSize size = layout.pages[page];
    const auto [a, b, c] = TexelCorners(world, layout, k);
    RasterizeExact(a, b, c, size.width, size.height, [&](int x, int y, const ConvexPolygon& polygon) {
      pieces.push_back(
          {page, TileOf(x, y, size.width), y, x, chart, k, std::fabs(polygon.SignedArea()), Centroid(polygon)});
    });
  }
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.Order() < b.Order(); });
  return pieces;
}

// Barycentrics of a page point in a charted triangle.
Vec2d BarycentricsAt(const std::array<Vec2d, 3>& corners, Vec2d p) {
  const Vec2d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0], d = p - corners[0];
  const double det = Cross(e1, e2);
  if (det == 0) return {1.0 / 3, 1.0 / 3};
  return {Cross(d, e2) / det, Cross(e1, d) / det};
}

Vec3f ShadingNormal(const World& world, const Triangle& t, Vec2f b) {
  const Object& object = world.scene().objects[t.object];
  const uint32_t* corner = object.index.data() + 3 * static_cast<size_t>(t.index_in_object);
  const auto& n = object.normal;
  if (n.empty()) return t.normal;
  const Vec3f normal = NormalizeOrZero(n[corner[0]] * (1 - b.x - b.y) + n[corner[1]] * b.x + n[corner[2]] * b.y);
  return Dot(normal, normal) > 0.5f ? normal : t.normal;
}

// World area of one square texel of a triangle's chart [m^2].
double TexelArea(const Triangle& t, const std::array<Vec2d, 3>& corners) {
  const double page_area = std::fabs(Cross(corners[1] - corners[0], corners[2] - corners[0]));
  return page_area > 0 ? static_cast<double>(Length(Cross(t.e1, t.e2))) / page_area : 0;
}

Texel MakeTexel(const World& world, const AtlasLayout& layout, std::span<const Piece> pieces) {
  Texel texel;
  texel.page = static_cast<int16_t>(pieces[0].page);
  texel.x = pieces[0].x;
  texel.y = pieces[0].y;
  Vec3d position, normal, smooth;
  double coverage = 0, area = 0, largest = 0;
  for (const Piece& piece : pieces) {
    const Triangle& t = world.triangles()[piece.triangle];
    const auto corners = TexelCorners(world, layout, piece.triangle);
    const Vec2d b = BarycentricsAt(corners, piece.centroid);
    const Vec2f bf{static_cast<float>(b.x), static_cast<float>(b.y)};
    position += (ToDouble(t.p0) + ToDouble(t.e1) * b.x + ToDouble(t.e2) * b.y) * piece.coverage;
    normal += ToDouble(t.normal) * piece.coverage;
    smooth += ToDouble(ShadingNormal(world, t, bf)) * piece.coverage;
    coverage += piece.coverage;
    area += piece.coverage * TexelArea(t, corners);
    if (piece.coverage > largest) texel.chart = piece.chart;
    largest = std::max(largest, piece.coverage);
    if (Dot(t.normal, world.triangles()[pieces[0].triangle].normal) < 0.9999f) texel.flat = false;
  }
  texel.coverage = static_cast<float>(coverage);
  texel.area = static_cast<float>(area);
  texel.position = ToFloat(position / coverage);
  texel.normal = ToFloat(NormalizeOrZero(normal));
  texel.smooth_normal = ToFloat(NormalizeOrZero(smooth));
  return texel;
}

}  // namespace

std::array<Vec2d, 3> TexelCorners(const World& world, const AtlasLayout& layout, uint32_t triangle) {
  const Triangle& t = world.triangles()[triangle];
  const ObjectCharts& charts = layout.objects[t.object];
  std::array<Vec2d, 3> corners;
  for (size_t i = 0; i < 3; ++i) {
    const TexelUv uv = charts.uv[charts.index[3 * static_cast<size_t>(t.index_in_object) + i]];
    corners[i] = {uv.x, uv.y};
  }
  return corners;
}

TexelMap RasterizeTexels(const World& world, const AtlasLayout& layout, float footprint, int page) {
  TexelMap map;
  map.footprint = footprint;
  map.pages = layout.pages;
  map.texel_at.resize(layout.pages.size());
  for (size_t p = 0; p < layout.pages.size(); ++p) {
    if (page != kAllPages && static_cast<size_t>(page) != p) continue;
    map.texel_at[p].assign(static_cast<size_t>(layout.pages[p].width) * static_cast<size_t>(layout.pages[p].height),
                           -1);
  }
  const std::vector<Piece> pieces = ClipAll(world, layout, page);
  std::pair<int32_t, int32_t> tile{-1, -1};
  for (size_t begin = 0, end = 0; begin < pieces.size(); begin = end) {
    while (end < pieces.size() && pieces[end].Place() == pieces[begin].Place()) ++end;
    const std::span<const Piece> group(pieces.data() + begin, end - begin);
    Texel texel = MakeTexel(world, layout, group);
    texel.fragment_begin = static_cast<uint32_t>(map.fragments.size());
    bool overlaps = false;
    for (const Piece& piece : group) {
      map.fragments.push_back({piece.triangle, static_cast<float>(piece.coverage)});
      overlaps |= piece.chart != texel.chart;
    }
    texel.fragment_end = static_cast<uint32_t>(map.fragments.size());
    map.overlapping_texels += overlaps ? 1 : 0;
    if (tile != std::pair(group[0].page, group[0].tile))
      map.tile_begin.push_back(static_cast<uint32_t>(map.texels.size()));
    tile = {group[0].page, group[0].tile};
    const size_t row = static_cast<size_t>(texel.y) * static_cast<size_t>(map.pages[texel.page].width);
    map.texel_at[texel.page][row + static_cast<size_t>(texel.x)] = static_cast<int32_t>(map.texels.size());
    map.texels.push_back(texel);
  }
  map.tile_begin.push_back(static_cast<uint32_t>(map.texels.size()));
  return map;
}

}  // namespace bakewell
