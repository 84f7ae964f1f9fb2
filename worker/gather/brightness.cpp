#include "worker/gather/brightness.h"

#include <algorithm>
#include <tuple>

namespace bakewell {
namespace {

constexpr float kBrightest = 1e15f;  // irradiance that is told from brighter ones [W m^-2]: all sums are finite

}  // namespace

BrightnessPyramid::BrightnessPyramid(const SurfaceCells& cells, const RadianceCache& cache, size_t most_patches)
    : cells_(cells), first_(cells.patches().size(), kNone) {
  struct Side {
    float square;
    uint32_t patch;
    bool back;
  };
  std::vector<Side> sides;
  for (uint32_t patch = 0; patch < cells.patches().size(); ++patch) {
    const uint32_t begin = cells.patches()[patch].first_cell;
    Sum sum;
    for (size_t c = begin; c < begin + SizeAt(patch, 0).count(); ++c)
      sum += SumOf(cells.cells()[c], &cache.light[2 * c]);
    for (const bool back : {false, true}) {
      if (sum.side[back ? 1 : 0].square > 0) sides.push_back({sum.side[back ? 1 : 0].square, patch, back});
    }
  }
  if (sides.size() > most_patches) {
    std::nth_element(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(most_patches), sides.end(),
                     [](const Side& a, const Side& b) {
                       return std::tuple(-a.square, a.patch, a.back) < std::tuple(-b.square, b.patch, b.back);
                     });
    sides.resize(most_patches);
  }
  for (const Side& side : sides) {
    if (first_[side.patch] == kNone) AddPatch(side.patch, cache);
    patches_.push_back(SpotOf(Whole(side.patch, side.back)));
  }
  std::sort(patches_.begin(), patches_.end(), [](const Spot& a, const Spot& b) {
    return std::tuple(-a.light.Typical(), a.square) < std::tuple(-b.light.Typical(), b.square);
  });
}

BrightnessPyramid::Sum& BrightnessPyramid::Sum::operator+=(const Sum& other) {
  for (size_t i = 0; i < side.size(); ++i) {
    side[i].flux += other.side[i].flux;
    side[i].square += other.side[i].square;
  }
  area += other.area;
  depth += other.depth;
  return *this;
}

BrightnessPyramid::Sum BrightnessPyramid::SumOf(const SurfaceCell& cell, const CachedLight* sides) const {
  Sum sum;
  for (size_t i = 0; i < sum.side.size(); ++i) {
    const float irradiance = std::min(kBrightest, std::max(0.0f, Luminance(sides[i].irradiance)));
    sum.side[i] = {irradiance * cell.area, irradiance * irradiance * cell.area};
  }
  sum.area = cell.area;
  return sum;
}

void BrightnessPyramid::AddPatch(uint32_t patch, const RadianceCache& cache) {
  first_[patch] = static_cast<uint32_t>(sums_.size());
  const CellPatch& grid = cells_.patches()[patch];
  const Vec3f normal = NormalizeOrZero(Cross(grid.t, grid.b));
  Size size = SizeAt(patch, 0);
  for (size_t c = grid.first_cell; c < grid.first_cell + size.count(); ++c) {
    const SurfaceCell& cell = cells_.cells()[c];
    sums_.push_back(SumOf(cell, &cache.light[2 * c]));
    sums_.back().depth = cell.area * Dot(cell.position - grid.origin, normal);
  }
  for (int level = 1; size.count() > 1; ++level) {
    const Size finer = size;
    const size_t begin = sums_.size(), below = begin - finer.count();
    size = SizeAt(patch, level);
    sums_.resize(begin + size.count());
    for (size_t i = 0; i < finer.count(); ++i) {
      const size_t width = static_cast<size_t>(finer.width), x = i % width / 2, y = i / width / 2;
      sums_[begin + y * static_cast<size_t>(size.width) + x] += sums_[below + i];
    }
  }
}

BrightnessPyramid::Square BrightnessPyramid::Whole(uint32_t patch, bool back) const {
  int level = 0;
  while (SizeAt(patch, level).count() > 1) ++level;
  return {patch, level, 0, 0, back};
}

BrightnessPyramid::Size BrightnessPyramid::SizeAt(uint32_t patch, int level) const {
  const CellPatch& grid = cells_.patches()[patch];
  const int rest = (1 << level) - 1;
  return {(grid.width + rest) >> level, (grid.height + rest) >> level};
}

BrightnessPyramid::Spot BrightnessPyramid::SpotOf(const Square& square) const {
  size_t at = first_[square.patch];
  for (int level = 0; level < square.level; ++level) at += SizeAt(square.patch, level).count();
  const auto width = static_cast<size_t>(SizeAt(square.patch, square.level).width);
  const Sum& sum = sums_[at + static_cast<size_t>(square.y) * width + static_cast<size_t>(square.x)];
  const CellPatch& grid = cells_.patches()[square.patch];
  // In cells, from begin to end.
  const auto span = [&](int i, int cells) {
    return std::pair(i << square.level, std::min((i + 1) << square.level, cells));
  };
  const auto [begin_x, end_x] = span(square.x, grid.width);
  const auto [begin_y, end_y] = span(square.y, grid.height);
  const Vec3f x = grid.t / Dot(grid.t, grid.t), y = grid.b / Dot(grid.b, grid.b), normal = NormalizeOrZero(Cross(x, y));
  Spot spot{square, sum.side[square.back ? 1 : 0], {}};
  spot.place.u = x * (0.5f * static_cast<float>(end_x - begin_x));
  spot.place.v = y * (0.5f * static_cast<float>(end_y - begin_y));
  spot.place.center = grid.origin + x * static_cast<float>(begin_x) + spot.place.u + y * static_cast<float>(begin_y) +
                      spot.place.v + normal * (sum.area > 0 ? sum.depth / sum.area : 0.0f);
  spot.place.normal = square.back ? -normal : normal;
  spot.place.area = 4 * Length(Cross(spot.place.u, spot.place.v));
  return spot;
}

void BrightnessPyramid::Split(const Square& square, std::vector<Spot>& parts) const {
  const Size size = SizeAt(square.patch, square.level - 1);
  for (int y = 2 * square.y; y < std::min(2 * square.y + 2, size.height); ++y) {
    for (int x = 2 * square.x; x < std::min(2 * square.x + 2, size.width); ++x) {
      const Spot part = SpotOf({square.patch, square.level - 1, x, y, square.back});
      if (part.light.square > 0) parts.push_back(part);
    }
  }
}

bool BrightnessPyramid::Holds(const Square& square, uint32_t triangle, Vec3f position) const {
  if (cells_.PatchOf(triangle) != square.patch) return false;
  const CellPatch& grid = cells_.patches()[square.patch];
  const auto cell = static_cast<int>(cells_.CellAt(triangle, position) - grid.first_cell);
  return cell % grid.width >> square.level == square.x && cell / grid.width >> square.level == square.y;
}

}  // namespace bakewell
