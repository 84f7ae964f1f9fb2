#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>
#include <numeric>

#include "worker/photon/cache.h"

namespace bakewell {
namespace {

constexpr std::array<std::array<int, 2>, 8> kSteps = {
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

// How far above the surface the short rays run, and how much of a cell other geometry may cut, in cells.
constexpr float kLift = 0.02f, kMayCut = 0.04f;
// Of a cell: photons that fall on less say nothing, and a single one a lot.
constexpr double kLeastArea = 1.0 / 16;

class Estimator {
 public:
  Estimator(const World& world, const SurfaceCells& cells, const PhotonMap& map, const PhotonPlan& plan,
            const DensityOptions& options)
      : world_(world), cells_(cells), map_(map), inverse_scale_(1 / plan.fixed_point_scale), options_(options) {
    cache_.light.resize(map.flux.size());
    open_.assign(map.flux.size(), 0);
    cut_.assign(map.flux.size(), 0);
  }

  RadianceCache Run(Progress& progress) {
    ForEachPatch([this](const CellPatch& patch) { ProbePatch(patch); });
    progress.Report("density", 1, 2);
    ForEachPatch([this](const CellPatch& patch) { AveragePatch(patch); });
    progress.Report("density", 2, 2);
    cache_.rays = rays_.load();
    cache_.unfaced_backs = {unprobed_.load(), sides_.load(), unprobed_.load() * std::ssize(kSteps)};
    for (const CellFlux& flux : map_.flux) cache_.photons_seen += flux.count;
    return std::move(cache_);
  }

 private:
  template <typename Visit>
  void ForEachPatch(Visit visit) {
    const auto& patches = cells_.patches();
    tbb::parallel_for(tbb::blocked_range<size_t>(0, patches.size()), [&](const tbb::blocked_range<size_t>& range) {
      for (size_t i = range.begin(); i < range.end(); ++i) visit(patches[i]);
    });
  }

  static size_t Index(const CellPatch& patch, int x, int y, int side) {
    const size_t cell =
        patch.first_cell + static_cast<size_t>(y) * static_cast<size_t>(patch.width) + static_cast<size_t>(x);
    return 2 * cell + static_cast<size_t>(side);
  }

  static bool Inside(const CellPatch& patch, int x, int y) {
    return x >= 0 && y >= 0 && x < patch.width && y < patch.height;
  }

  // A side of a patch without a photon needs no probes: its estimate is zero whatever the neighbourhoods.
  bool Lit(const CellPatch& patch, int side) const {
    for (int y = 0; y < patch.height; ++y) {
      for (int x = 0; x < patch.width; ++x) {
        if (map_.flux[Index(patch, x, y, side)].count > 0) return true;
      }
    }
    return false;
  }

  void ProbePatch(const CellPatch& patch) {
    for (int side = 0; side < 2; ++side) {
      const bool lit = Lit(patch, side);
      for (int y = 0; y < patch.height; ++y) {
        for (int x = 0; x < patch.width; ++x) {
          const size_t i = Index(patch, x, y, side);
          if (cells_.cells()[i / 2].area <= 0) continue;
          ++sides_;
          if (lit || options_.probe_unlit) {
            Probe(patch, i, side, x, y);
          } else {
            ++unprobed_;
          }
        }
      }
    }
  }

  // Eight rays over the surface from the cell's centre: a free one opens the way to that neighbour, a short one cuts
  // the cell.
  void Probe(const CellPatch& patch, size_t i, int side, int x, int y) {
    const SurfaceCell& cell = cells_.cells()[i / 2];
    const Vec3f normal = side == 0 ? cell.normal : -cell.normal;
    const Vec3f step_x = patch.t / Dot(patch.t, patch.t), step_y = patch.b / Dot(patch.b, patch.b);
    const Vec3f lift = normal * (kLift * patch.cell_side_m);
    rays_ += static_cast<int64_t>(kSteps.size());
    for (size_t k = 0; k < kSteps.size(); ++k) {
      const int nx = x + kSteps[k][0], ny = y + kSteps[k][1];
      const Vec3f across = step_x * static_cast<float>(kSteps[k][0]) + step_y * static_cast<float>(kSteps[k][1]);
      const Vec3f tangent = across - normal * Dot(across, normal);
      const float full = Length(across);
      const bool neighbour = Inside(patch, nx, ny) && cells_.cells()[Index(patch, nx, ny, side) / 2].area > 0;
      const Vec3f to = neighbour ? NeighbourCenter(patch, nx, ny, side) - cell.position : tangent;
      const Hit hit = world_.Intersect({cell.position + lift, NormalizeOrZero(to), std::max(full, Length(to)), 0});
      if (hit && hit.t < (0.5f - kMayCut) * full && CutsCell(patch, cell, hit)) cut_[i] = 1;
      if (neighbour && (!hit || hit.t >= Length(to))) open_[i] |= static_cast<uint8_t>(1U << k);
    }
  }

  Vec3f NeighbourCenter(const CellPatch& patch, int x, int y, int side) const {
    const SurfaceCell& cell = cells_.cells()[Index(patch, x, y, side) / 2];
    return cell.position + (side == 0 ? cell.normal : -cell.normal) * (kLift * patch.cell_side_m);
  }

  // A hit on the patch's own surface (a curved one) does not cut.
  bool CutsCell(const CellPatch& patch, const SurfaceCell& cell, const Hit& hit) const {
    const CellPatch& other = cells_.patches()[cells_.PatchOf(hit.triangle)];
    return &other != &patch || std::fabs(Dot(world_.triangles()[hit.triangle].normal, cell.normal)) < 0.7f;
  }

  struct Sum {
    std::array<double, 3> flux{};
    std::array<double, kVarianceGroups> group{};
    double area = 0, met = 0;  // of the surface; of what rays meet of it
    int64_t count = 0;
  };

  void AddCell(size_t i, Sum& sum) const {
    const CellFlux& flux = map_.flux[i];
    for (size_t c = 0; c < 3; ++c) {
      sum.flux[c] += static_cast<double>(flux.flux[c]);
    }
    for (size_t g = 0; g < kVarianceGroups; ++g) sum.group[g] += static_cast<double>(flux.group[g]);
    const SurfaceCell& cell = cells_.cells()[i / 2];
    sum.area += static_cast<double>(cell.area);
    sum.met += static_cast<double>(cell.area * cell.met[i % 2]);
    sum.count += flux.count;
  }

  // Sums the cells within `radius` that open ways connect to (x, y).
  Sum Flood(const CellPatch& patch, int x, int y, int side, int radius) const {
    constexpr int kWidest = 15;
    std::array<bool, kWidest * kWidest> seen{};
    std::array<std::array<int, 2>, kWidest * kWidest> queue;
    const int width = 2 * radius + 1;
    size_t tail = 0;
    const auto push = [&](int px, int py) {
      const size_t at = static_cast<size_t>((py - y + radius) * width + px - x + radius);
      if (seen[at]) return;
      seen[at] = true;
      queue[tail++] = {px, py};
    };
    push(x, y);
    Sum sum;
    for (size_t head = 0; head < tail; ++head) {
      const auto [px, py] = queue[head];
      const size_t i = Index(patch, px, py, side);
      AddCell(i, sum);
      for (size_t k = 0; k < kSteps.size(); ++k) {
        const int nx = px + kSteps[k][0], ny = py + kSteps[k][1];
        if (std::abs(nx - x) > radius || std::abs(ny - y) > radius || !(open_[i] >> k & 1)) continue;
        const size_t j = Index(patch, nx, ny, side);
        if ((open_[j] >> (k < 4 ? (k + 2) % 4 : 4 + (k + 2) % 4) & 1) && !cut_[j]) push(nx, ny);
      }
    }
    return sum;
  }

  void AveragePatch(const CellPatch& patch) {
    for (int side = 0; side < 2; ++side) {
      for (int y = 0; y < patch.height; ++y) {
        for (int x = 0; x < patch.width; ++x) Average(patch, x, y, side);
      }
    }
  }

  // The radius follows from the density of photons in the widest neighbourhood, not from when a growing one happens to
  // hold enough: that would favour neighbourhoods that are too bright (a bias of about one part in target_count).
  void Average(const CellPatch& patch, int x, int y, int side) {
    const size_t i = Index(patch, x, y, side);
    if (cells_.cells()[i / 2].area <= 0) return;
    int radius = 0;
    const double cell_area = static_cast<double>(patch.cell_side_m) * static_cast<double>(patch.cell_side_m);
    const double least_area = kLeastArea * cell_area;
    if (!cut_[i] && open_[i] != 0) {
      const Sum widest = Flood(patch, x, y, side, options_.max_radius);
      const double per_area = static_cast<double>(widest.count) / widest.area;
      while (radius < options_.max_radius &&
             per_area * cell_area * (2 * radius + 1) * (2 * radius + 1) < options_.target_count)
        ++radius;
      if (radius == options_.max_radius) return Store(i, widest, radius, least_area);
    }
    Store(i, Flood(patch, x, y, side, radius), radius, least_area);
  }

  void Store(size_t i, const Sum& sum, int radius, double least_area) {
    if (sum.met <= 0) return;
    const double per_area = inverse_scale_ / sum.met;
    CachedLight& light = cache_.light[i];
    light.irradiance = {static_cast<float>(sum.flux[0] * per_area), static_cast<float>(sum.flux[1] * per_area),
                        static_cast<float>(sum.flux[2] * per_area)};
    const double all = std::accumulate(sum.group.begin(), sum.group.end(), 0.0);
    for (size_t g = 0; g < kVarianceGroups && all > 0; ++g) {
      light.group_share[g] = static_cast<uint16_t>(65535 * (sum.group[g] / all) + 0.5);
    }
    light.window = cut_[i] || sum.met < least_area ? 0 : static_cast<uint8_t>(2 * radius + 1);
  }

  const World& world_;
  const SurfaceCells& cells_;
  const PhotonMap& map_;
  const double inverse_scale_;
  const DensityOptions options_;
  RadianceCache cache_;
  std::vector<uint8_t> open_;  // per side: bit k, the way to neighbour kSteps[k] is free
  std::vector<uint8_t> cut_;   // per side: 1 where other geometry runs through the cell
  std::atomic<int64_t> rays_{0}, sides_{0}, unprobed_{0};
};

}  // namespace

RadianceCache EstimateDensity(const World& world, const SurfaceCells& cells, const PhotonMap& map,
                              const PhotonPlan& plan, const DensityOptions& options, Progress& progress) {
  return Estimator(world, cells, map, plan, options).Run(progress);
}

}  // namespace bakewell
