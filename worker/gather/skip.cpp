#include "worker/gather/skip.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/sample/hash.h"

namespace bakewell {
namespace {

constexpr int kReach = 3;  // cells on each side that count as evidence, as far as a density estimate looks
constexpr size_t kAuditOne = 64, kAuditLeast = 4;
constexpr std::array<Vec2f, 5> kPlaces = {{{0.5f, 0.5f}, {0.01f, 0.01f}, {0.99f, 0.01f}, {0.01f, 0.99f}, {0.99f, 0.99f}}};

}  // namespace

double PhotonDarkness::Area(float least, float photon_flux) {
  if (!(least > 0 && photon_flux > 0)) return std::numeric_limits<double>::infinity();
  return kSure * static_cast<double>(photon_flux) / static_cast<double>(least);
}

PhotonDarkness::Dark PhotonDarkness::At(const TexelPoint& point) const {
  const uint32_t triangle = point.surface.triangle;
  const uint32_t cell = cells_.CellAt(triangle, point.surface.position);
  const CellPatch& patch = cells_.patches()[cells_.PatchOf(triangle)];
  const auto is_dark = [this](size_t at) {
    const CellIrradiance& light = cache_.irradiance[2 * at];
    const bool direct = MaxComponent(light.direct) <= 0;
    return Dark{direct, direct && MaxComponent(light.indirect) <= 0};
  };
  const Dark here = is_dark(cell);
  // A cell that others cut says nothing; one with a narrow window is evidence only where all around it is dark.
  const uint8_t window = cache_.window[2 * static_cast<size_t>(cell)];
  if (!here.direct || window == 0) return {};
  const bool wide = window > 2 * kReach;
  const int x = static_cast<int>(cell - patch.first_cell) % patch.width;
  const int y = static_cast<int>(cell - patch.first_cell) / patch.width;
  double direct_area = 0, area = 0;
  for (int ny = std::max(0, y - kReach); ny <= std::min(patch.height - 1, y + kReach); ++ny) {
    for (int nx = std::max(0, x - kReach); nx <= std::min(patch.width - 1, x + kReach); ++nx) {
      const size_t at = patch.first_cell + static_cast<size_t>(ny) * static_cast<size_t>(patch.width) + nx;
      const Dark dark = is_dark(at);
      if (!wide && !dark.direct) return {};
      if (dark.direct) direct_area += static_cast<double>(cells_.cells()[at].area);
      if (dark.all) area += static_cast<double>(cells_.cells()[at].area);
    }
  }
  return {direct_area >= needed_area_, here.all && (wide || area == direct_area) && area >= needed_area_};
}

PhotonDarkness::Dark PhotonDarkness::Of(const TexelSampler& sampler) const {
  Dark dark{true, true};
  for (const Vec2f place : kPlaces) {
    const Dark at = At(sampler.At(place));
    dark = {dark.direct && at.direct, dark.all && at.all};
    if (!dark.direct) break;
  }
  return dark;
}

float MeanPhotonFlux(const SurfaceCells& cells, const RadianceCache& cache) {
  double flux = 0;
  for (size_t i = 0; i < cache.irradiance.size(); ++i) {
    const CellIrradiance& light = cache.irradiance[i];
    flux += static_cast<double>(Luminance(light.direct + light.indirect)) *
            static_cast<double>(cells.cells()[i / 2].area);
  }
  return cache.photons_seen > 0 ? static_cast<float>(flux / static_cast<double>(cache.photons_seen)) : 0;
}

std::vector<bool> DrawAudit(std::span<const uint32_t> keys, std::span<const Leaves> texels, Leaves leaves) {
  std::vector<std::pair<uint32_t, size_t>> lots;
  for (size_t i = 0; i < keys.size(); ++i) {
    if (texels[i] == leaves) lots.push_back({HashCombine(keys[i], 0xa0d17u), i});
  }
  const size_t count = std::min(lots.size(), std::max(kAuditLeast, lots.size() / kAuditOne));
  std::partial_sort(lots.begin(), lots.begin() + static_cast<ptrdiff_t>(count), lots.end());
  std::vector<bool> audited(keys.size(), false);
  for (size_t i = 0; i < count; ++i) audited[lots[i].second] = true;
  return audited;
}

void SkipAudit::Found(Leaves leaves, float lost, float tolerated, int64_t rays) {
  Sum& sum = of_[static_cast<size_t>(leaves)];
  ++sum.texels;
  sum.rays += rays;
  if (!(lost <= tolerated)) passes_ = false;
  constexpr float kMost = 1;  // so that the squares of a million texels can be added up
  const int64_t ppm = std::llround(1e6 * static_cast<double>(std::min(lost, kMost)));
  largest_ppm_ = std::max(largest_ppm_, ppm);
  square_ppm2_ += ppm * ppm;
}

void SkipAudit::Count(Skip skip, Leaves leaves, int64_t skipped, int64_t of, int64_t rays, SkipTally& tally) const {
  const Sum& audited = of_[static_cast<size_t>(leaves)];
  const int64_t full = audited.texels > 0 ? audited.rays * skipped / audited.texels : 0;
  tally[skip].skipped += skipped;
  tally[skip].of += of;
  tally[skip].saved += std::max<int64_t>(0, full - rays * skipped);
}

void SkipAudit::Count(SkipTally& tally) const {
  for (const Sum& sum : of_) tally.audited += sum.texels;
  tally.found_ppm = std::max(tally.found_ppm, largest_ppm_);
  if (!passes_) {
    ++tally.failed_over;
    return;
  }
  tally.largest_ppm = std::max(tally.largest_ppm, largest_ppm_);
  tally.square_ppm2 += square_ppm2_;
}

}  // namespace bakewell
