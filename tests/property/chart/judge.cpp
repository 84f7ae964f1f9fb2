#include "tests/property/chart/judge.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bakewell::chart {
namespace {

constexpr int64_t kGrid = 4096;

struct Point {
  int64_t x, y;
};
using Triangle = std::array<Point, 3>;

int64_t Cross(Point a, Point b, Point p) { return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x); }

// A shared edge belongs to one of its two triangles.
bool Owns(Point a, Point b) { return b.y < a.y || (b.y == a.y && b.x > a.x); }

bool CoversCentre(const Triangle& t, int x, int y) {
  const Point p{x * kGrid + kGrid / 2, y * kGrid + kGrid / 2};
  for (int k = 0; k < 3; ++k) {
    const int64_t side = Cross(t[k], t[(k + 1) % 3], p);
    if (side < 0 || (side == 0 && !Owns(t[k], t[(k + 1) % 3]))) return false;
  }
  return true;
}

struct Page {
  std::vector<int32_t> owner;  // chart whose triangle covers the centre, -1: none
};

class Judge {
 public:
  Judge(const MeshDecl& decl, const Atlas& atlas, uint32_t padding)
      : decl_(decl), atlas_(atlas), mesh_(atlas.meshes[0]), padding_(static_cast<int>(padding)) {}

  std::string Run() {
    if (std::string fault = Corners(); !fault.empty()) return fault;
    if (std::string fault = Mapping(); !fault.empty()) return fault;
    pages_.assign(atlas_.atlasCount, {std::vector<int32_t>(size_t{atlas_.width} * atlas_.height, -1)});
    for (size_t c = 0; c < mesh_.chartArray.size(); ++c)
      for (const uint32_t t : mesh_.chartArray[c].faceArray)
        if (std::string fault = Draw(static_cast<int32_t>(c), t); !fault.empty()) return fault;
    return Gaps();
  }

 private:
  const Vertex& Corner(uint32_t t, int k) const { return mesh_.vertexArray[mesh_.indexArray[3 * t + k]]; }

  std::string Corners() const {
    if (mesh_.indexArray.size() != decl_.indexData.size()) return "index count differs";
    for (size_t i = 0; i < mesh_.indexArray.size(); ++i) {
      const Vertex& v = mesh_.vertexArray.at(mesh_.indexArray[i]);
      if (v.xref != decl_.indexData[i]) return "xref of corner " + std::to_string(i);
      const bool inside =
          v.uv[0] >= 0 && v.uv[1] >= 0 && v.uv[0] <= float(atlas_.width) && v.uv[1] <= float(atlas_.height);
      if (!inside) return "UV of corner " + std::to_string(i) + " is outside the page";
    }
    return "";
  }

  std::string Mapping() const {
    std::vector<int> uses(mesh_.faceState.size(), 0);
    for (const Chart& chart : mesh_.chartArray)
      for (const uint32_t t : chart.faceArray) ++uses[t];
    for (size_t t = 0; t < uses.size(); ++t)
      if (uses[t] != (mesh_.faceState[t] == FaceState::kCharted ? 1 : 0))
        return "triangle " + std::to_string(t) + " is in " + std::to_string(uses[t]) + " charts";
    return "";
  }

  std::string Draw(int32_t chart, uint32_t t) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k)
      triangle[k] = {std::llround(double(Corner(t, k).uv[0]) * kGrid),
                     std::llround(double(Corner(t, k).uv[1]) * kGrid)};
    const Vertex &a = Corner(t, 0), &b = Corner(t, 1), &c = Corner(t, 2);
    const double area = (double(b.uv[0]) - a.uv[0]) * (double(c.uv[1]) - a.uv[1]) -
                        (double(b.uv[1]) - a.uv[1]) * (double(c.uv[0]) - a.uv[0]);
    if (area < 0) return "triangle " + std::to_string(t) + " is flipped";
    if (Cross(triangle[0], triangle[1], triangle[2]) <= 0) return "";
    const auto [x0, x1] = std::minmax({triangle[0].x, triangle[1].x, triangle[2].x});
    const auto [y0, y1] = std::minmax({triangle[0].y, triangle[1].y, triangle[2].y});
    std::vector<int32_t>& owner = pages_[a.atlasIndex].owner;
    for (int y = int(y0 / kGrid); y < std::min<int64_t>(y1 / kGrid + 1, atlas_.height); ++y)
      for (int x = int(x0 / kGrid); x < std::min<int64_t>(x1 / kGrid + 1, atlas_.width); ++x) {
        if (!CoversCentre(triangle, x, y)) continue;
        int32_t& texel = owner[size_t{atlas_.width} * y + x];
        if (texel >= 0)
          return "texel " + std::to_string(x) + "," + std::to_string(y) + " is covered by charts " +
                 std::to_string(texel) + " and " + std::to_string(chart);
        texel = chart;
      }
    return "";
  }

  std::string Gaps() const {
    const int width = static_cast<int>(atlas_.width), height = static_cast<int>(atlas_.height);
    for (const Page& page : pages_)
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const int32_t chart = page.owner[size_t(width) * y + x];
          for (int dy = 0; chart >= 0 && dy <= padding_ && y + dy < height; ++dy)
            for (int dx = -padding_; dx <= padding_; ++dx) {
              if (x + dx < 0 || x + dx >= width) continue;
              const int32_t other = page.owner[size_t(width) * (y + dy) + x + dx];
              if (other >= 0 && other != chart)
                return "charts " + std::to_string(chart) + " and " + std::to_string(other) + " are too close";
            }
        }
    return "";
  }

  const MeshDecl& decl_;
  const Atlas& atlas_;
  const Mesh& mesh_;
  int padding_;
  std::vector<Page> pages_;
};

}  // namespace

std::string FindFault(const MeshDecl& decl, const Atlas& atlas, uint32_t padding) {
  return Judge(decl, atlas, padding).Run();
}

}  // namespace bakewell::chart
