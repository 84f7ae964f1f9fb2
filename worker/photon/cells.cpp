#include "worker/photon/cells.h"

#include <bit>
#include <cmath>
#include <map>

#include "core/base/check.h"
#include "worker/photon/patches.h"
#include "worker/sample/hash.h"
#include "worker/sample/warp.h"
#include "worker/texel/raster.h"

namespace bakewell {
namespace {

std::array<Vec3f, 3> Corners(const Triangle& t) { return {t.p0, t.p0 + t.e1, t.p0 + t.e2}; }

double AreaOf(const Triangle& t) { return 0.5 * Length(Cross(ToDouble(t.e1), ToDouble(t.e2))); }

Vec3f MeanNormal(const World& world, const std::vector<uint32_t>& triangles) {
  Vec3d sum;
  for (const uint32_t k : triangles) sum += ToDouble(world.triangles()[k].normal) * AreaOf(world.triangles()[k]);
  return ToFloat(NormalizeOrZero(sum));
}

// The direction of the longest edge that only one triangle of the patch has: walls get cells along their sides.
Vec3f LongestBoundaryEdge(const World& world, const std::vector<uint32_t>& triangles) {
  struct Less {
    bool operator()(Vec3f a, Vec3f b) const { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }
  };
  std::map<Vec3f, int, Less> uses;  // by edge midpoint
  const auto edges = [&](uint32_t k) {
    const Object& object = world.scene().objects[world.triangles()[k].object];
    const uint32_t* corner = object.index.data() + 3 * static_cast<size_t>(world.triangles()[k].index_in_object);
    return std::array<Vec3f, 3>{object.position[corner[0]], object.position[corner[1]], object.position[corner[2]]};
  };
  for (const uint32_t k : triangles) {
    const auto p = edges(k);
    for (size_t i = 0; i < 3; ++i) ++uses[p[i] + p[(i + 1) % 3]];
  }
  Vec3f best{1, 0, 0};
  float longest = -1;
  for (const uint32_t k : triangles) {
    const auto p = edges(k);
    for (size_t i = 0; i < 3; ++i) {
      const Vec3f edge = p[(i + 1) % 3] - p[i];
      if (uses[p[i] + p[(i + 1) % 3]] != 1 || Dot(edge, edge) <= longest * 1.0001f) continue;
      longest = Dot(edge, edge);
      best = edge;
    }
  }
  return best;
}

// Sums of one cell while its patch is measured.
struct CellSum {
  double projected = 0, area = 0;
  std::array<double, 2> met{};  // projected
  Vec3d position, normal;
};

// Integral of World::ShareMet from the front and the back over a part of a triangle, given in the plane and by the
// barycentrics of a point of the plane: nine jittered points in each triangle of its fan.
template <typename Barycentrics>
std::array<double, 2> MetArea(const World& world, uint32_t triangle, const ConvexPolygon& part,
                              Barycentrics barycentrics) {
  if (world.IsAlwaysMet(triangle)) return {std::fabs(part.SignedArea()), std::fabs(part.SignedArea())};
  constexpr int kSide = 3;
  std::array<double, 2> met{};
  for (int i = 1; i + 1 < part.count; ++i) {
    const Vec2d a = part.corner[i] - part.corner[0], b = part.corner[i + 1] - part.corner[0];
    const double area = 0.5 * std::fabs(Cross(a, b)) / (kSide * kSide);
    for (int s = 0; s < kSide * kSide; ++s) {
      const Vec2f at = barycentrics(part.corner[0] + a * 0.5 + b * 0.25);
      const uint32_t key = HashCombine(HashCombine(triangle, std::bit_cast<uint32_t>(at.x)), static_cast<uint32_t>(s));
      const Vec2f w = TriangleFromSquare({(static_cast<float>(s % kSide) + UnitFloat(Hash(key))) / kSide,
                                          (static_cast<float>(s / kSide) + UnitFloat(Hash(key + 1))) / kSide});
      const Vec2f p = barycentrics(part.corner[0] + a * static_cast<double>(w.x) + b * static_cast<double>(w.y));
      for (size_t side = 0; side < 2; ++side) {
        met[side] += area * static_cast<double>(world.ShareMet(triangle, p.x, p.y, side == 1));
      }
    }
  }
  return met;
}

constexpr int64_t kMaxPatchCells = int64_t{1} << 28;
constexpr int kMostDoublings = 6, kSpared = 2;  // of the smallest cells' sides; doublings that are not worth it

// How often each patch's cells are to double their sides: as many rays should meet a cell of a patch as of those that
// rays meet most often. Patches of which the rays can tell nothing count as such. Whole doublings: a level that is
// turned keeps its cells, though a ray or two may go elsewhere.
std::vector<int> DoublingsOf(const World& world, std::span<const std::vector<uint32_t>> patches,
                             std::span<const uint32_t> seen) {
  std::vector<double> area(patches.size(), 0), rays(patches.size(), 0);
  double all = 0, mean = 0;  // the density that a ray finds on the mean
  for (size_t i = 0; i < patches.size(); ++i) {
    for (const uint32_t k : patches[i]) {
      area[i] += AreaOf(world.triangles()[k]);
      rays[i] += seen.empty() ? 0 : seen[k];
    }
    all += rays[i];
    if (rays[i] > 0) mean += rays[i] * rays[i] / area[i];
  }
  std::vector<int> doublings(patches.size(), 0);
  if (!(mean > 0)) return doublings;
  mean /= all;
  constexpr double kPrior = 8;  // rays
  for (size_t i = 0; i < patches.size(); ++i) {
    const double density = (rays[i] + kPrior) / (area[i] + kPrior / mean);
    doublings[i] =
        std::clamp(static_cast<int>(std::lround(0.5 * std::log2(mean / density))) - kSpared, 0, kMostDoublings);
  }
  return doublings;
}

// False where the patch folds over itself.
bool MeasurePatch(const World& world, const std::vector<uint32_t>& triangles, CellPatch& patch,
                  std::vector<SurfaceCell>& cells) {
  const Frame frame = FrameFromHint(MeanNormal(world, triangles), LongestBoundaryEdge(world, triangles));
  const Vec3f anchor = world.triangles()[triangles[0]].p0;
  double low_x = 1e300, low_y = 1e300, high_x = -1e300, high_y = -1e300;
  for (const uint32_t k : triangles) {
    for (const Vec3f p : Corners(world.triangles()[k])) {
      const double x = Dot(p - anchor, frame.t), y = Dot(p - anchor, frame.b);
      low_x = std::min(low_x, x), high_x = std::max(high_x, x);
      low_y = std::min(low_y, y), high_y = std::max(high_y, y);
    }
  }
  patch.origin = anchor + frame.t * static_cast<float>(low_x) + frame.b * static_cast<float>(low_y);
  const auto divide = [&](double extent) {
    return std::max(1, static_cast<int>(std::ceil(extent / patch.cell_side_m - 1e-3)));
  };
  patch.width = divide(high_x - low_x);
  patch.height = divide(high_y - low_y);
  const double side_x = high_x > low_x ? (high_x - low_x) / patch.width : patch.cell_side_m;
  const double side_y = high_y > low_y ? (high_y - low_y) / patch.height : patch.cell_side_m;
  patch.t = frame.t * static_cast<float>(1 / side_x);
  patch.b = frame.b * static_cast<float>(1 / side_y);
  BAKEWELL_CHECK_OP(int64_t{patch.width} * patch.height, <, kMaxPatchCells);
  std::vector<CellSum> sums(static_cast<size_t>(patch.width) * static_cast<size_t>(patch.height));
  for (const uint32_t k : triangles) {
    const Triangle& t = world.triangles()[k];
    const double per_projected = 1.0 / std::max(1e-3, std::fabs(static_cast<double>(Dot(t.normal, frame.n))));
    std::array<Vec2d, 3> flat;
    const auto corners = Corners(t);
    for (size_t i = 0; i < 3; ++i) {
      const Vec3f d = corners[i] - patch.origin;
      flat[i] = {static_cast<double>(Dot(d, patch.t)), static_cast<double>(Dot(d, patch.b))};
      flat[i].x = std::clamp(flat[i].x, 0.0, static_cast<double>(patch.width));
      flat[i].y = std::clamp(flat[i].y, 0.0, static_cast<double>(patch.height));
    }
    const Vec2d e1 = flat[1] - flat[0], e2 = flat[2] - flat[0];
    const double det = Cross(e1, e2);
    if (det == 0) continue;
    RasterizeExact(
        flat[0], flat[1], flat[2], patch.width, patch.height, [&](int x, int y, const ConvexPolygon& polygon) {
          CellSum& sum = sums[static_cast<size_t>(y) * static_cast<size_t>(patch.width) + static_cast<size_t>(x)];
          const double projected = std::fabs(polygon.SignedArea());
          const auto barycentrics = [&](Vec2d p) {
            return Vec2f{static_cast<float>(Cross(p - flat[0], e2) / det),
                         static_cast<float>(Cross(e1, p - flat[0]) / det)};
          };
          const auto met = MetArea(world, k, polygon, barycentrics);
          sum.met = {sum.met[0] + met[0], sum.met[1] + met[1]};
          Vec2d center;
          for (int i = 0; i < polygon.count; ++i) center = center + polygon.corner[i] * (1.0 / polygon.count);
          const Vec2d d = center - flat[0];
          const double u = Cross(d, e2) / det, v = Cross(e1, d) / det;
          sum.projected += projected;
          sum.area += projected * per_projected;
          sum.position += (ToDouble(t.p0) + ToDouble(t.e1) * u + ToDouble(t.e2) * v) * projected;
          sum.normal += ToDouble(t.normal) * projected;
        });
  }
  const double square = side_x * side_y;
  cells.clear();
  for (const CellSum& sum : sums) {
    if (sum.projected > 1.01 && triangles.size() > 1) return false;
    if (sum.projected <= 0) {
      cells.push_back({});
      continue;
    }
    cells.push_back({static_cast<float>(sum.area * square),
                     ToFloat(sum.position / sum.projected),
                     ToFloat(NormalizeOrZero(sum.normal)),
                     {static_cast<float>(sum.met[0] / sum.projected), static_cast<float>(sum.met[1] / sum.projected)}});
  }
  return true;
}

}  // namespace

void SurfaceCells::AddPatch(const World& world, std::vector<uint32_t> triangles, float cell_side_m) {
  CellPatch patch;
  patch.cell_side_m = cell_side_m;
  std::vector<SurfaceCell> cells;
  if (!MeasurePatch(world, triangles, patch, cells)) {
    // The patch folds over itself (a spiral stair): halve it in breadth-first order until it does not.
    const auto middle = triangles.begin() + static_cast<std::ptrdiff_t>(triangles.size() / 2);
    AddPatch(world, {triangles.begin(), middle}, cell_side_m);
    AddPatch(world, {middle, triangles.end()}, cell_side_m);
    return;
  }
  patch.first_cell = static_cast<uint32_t>(cells_.size());
  for (const uint32_t k : triangles) patch_of_triangle_[k] = static_cast<uint32_t>(patches_.size());
  patches_.push_back(patch);
  cells_.insert(cells_.end(), cells.begin(), cells.end());
}

SurfaceCells SurfaceCells::Build(const World& world, int64_t target_cells, std::span<const uint32_t> seen) {
  SurfaceCells result;
  for (const Triangle& t : world.triangles()) result.total_area_ += AreaOf(t);
  if (world.triangles().empty()) return result;
  result.patch_of_triangle_.assign(world.triangles().size(), 0);
  std::vector<std::vector<uint32_t>> patches = GrowPatches(world);
  const std::vector<int> doublings = DoublingsOf(world, patches, seen);
  double squares = 0;  // of the smallest cells' sides
  for (size_t i = 0; i < patches.size(); ++i) {
    for (const uint32_t k : patches[i]) squares += std::ldexp(AreaOf(world.triangles()[k]), -2 * doublings[i]);
  }
  const double side = std::sqrt(squares / static_cast<double>(std::max<int64_t>(target_cells, 1)));
  for (size_t i = 0; i < patches.size(); ++i) {
    result.AddPatch(world, std::move(patches[i]), static_cast<float>(std::ldexp(side, doublings[i])));
  }
  return result;
}

}  // namespace bakewell
