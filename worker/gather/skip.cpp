#include "worker/gather/skip.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "worker/sample/hash.h"

namespace bakewell {
namespace {

constexpr int kReach = 3;  // cells on each side that count as evidence, as far as a density estimate looks
constexpr size_t kAuditOne = 64, kAuditLeast = 4;
constexpr std::array<Vec2f, 5> kPlaces = {
    {{0.5f, 0.5f}, {0.01f, 0.01f}, {0.99f, 0.01f}, {0.01f, 0.99f}, {0.99f, 0.99f}}};

double NeededArea(float least, float photon_flux) {
  if (!(least > 0 && photon_flux > 0)) return std::numeric_limits<double>::infinity();
  return PhotonDarkness::kSure * static_cast<double>(photon_flux) / static_cast<double>(least);
}

}  // namespace

PhotonDarkness::PhotonDarkness(const SurfaceCells& cells, const RadianceCache& cache, float least, float photon_flux)
    : cells_(cells), cache_(cache), needed_area_(NeededArea(least, photon_flux)) {}

bool PhotonDarkness::IsDark(size_t cell) const {
  const CellIrradiance& light = cache_.irradiance[2 * cell];
  return MaxComponent(light.direct) <= 0 && MaxComponent(light.indirect) <= 0;
}

bool PhotonDarkness::CoversPlace(const SurfacePoint& point) const {
  const size_t cell = cells_.CellAt(point.triangle, point.position);
  const CellPatch& patch = cells_.patches()[cells_.PatchOf(point.triangle)];
  // A cell that others cut says nothing; one with a narrow window is evidence only where all around it is dark.
  const uint8_t window = cache_.window[2 * cell];
  if (window == 0 || !IsDark(cell)) return false;
  const int x = static_cast<int>(cell - patch.first_cell) % patch.width;
  const int y = static_cast<int>(cell - patch.first_cell) / patch.width;
  double area = 0;
  for (int ny = std::max(0, y - kReach); ny <= std::min(patch.height - 1, y + kReach); ++ny) {
    for (int nx = std::max(0, x - kReach); nx <= std::min(patch.width - 1, x + kReach); ++nx) {
      const size_t at = patch.first_cell + static_cast<size_t>(ny) * static_cast<size_t>(patch.width) + nx;
      if (IsDark(at)) {
        area += static_cast<double>(cells_.cells()[at].area);
      } else if (window <= 2 * kReach) {
        return false;
      }
    }
  }
  return area >= needed_area_;
}

bool PhotonDarkness::Covers(const TexelSampler& sampler) const {
  return std::all_of(kPlaces.begin(), kPlaces.end(),
                     [&](Vec2f place) { return CoversPlace(sampler.At(place).surface); });
}

float MeanPhotonFlux(const SurfaceCells& cells, const RadianceCache& cache) {
  double flux = 0;
  for (size_t i = 0; i < cache.irradiance.size(); ++i) {
    const CellIrradiance& light = cache.irradiance[i];
    flux +=
        static_cast<double>(Luminance(light.direct + light.indirect)) * static_cast<double>(cells.cells()[i / 2].area);
  }
  return cache.photons_seen > 0 ? static_cast<float>(flux / static_cast<double>(cache.photons_seen)) : 0;
}

std::vector<bool> DrawAudit(std::span<const uint32_t> keys, const std::vector<bool>& leaves_out) {
  std::vector<std::pair<uint32_t, size_t>> lots;
  for (size_t i = 0; i < keys.size(); ++i) {
    if (leaves_out[i]) lots.push_back({HashCombine(keys[i], 0xa0d17u), i});
  }
  const size_t count = std::min(lots.size(), std::max(kAuditLeast, lots.size() / kAuditOne));
  std::partial_sort(lots.begin(), lots.begin() + static_cast<ptrdiff_t>(count), lots.end());
  std::vector<bool> audited(keys.size(), false);
  for (size_t i = 0; i < count; ++i) audited[lots[i].second] = true;
  return audited;
}

void SkipAudit::Found(float lost, float tolerated, float mean, int64_t rays) {
  ++texels_;
  rays_ += rays;
  if (!(lost > 0)) return;
  if (!(lost <= tolerated)) passes_ = false;
  constexpr float kMost = 1;  // so that the squares of a million texels can be added up
  const int64_t ppm = std::llround(1e6 * static_cast<double>(lost < kMost * mean ? lost / mean : kMost));
  largest_ppm_ = std::max(largest_ppm_, ppm);
  square_ppm2_ += ppm * ppm;
}

void SkipAudit::Count(SkipTally& tally) const {
  tally.audited += texels_;
  tally.found_ppm = std::max(tally.found_ppm, largest_ppm_);
  if (!passes_) {
    ++tally.failed_over;
    return;
  }
  tally.largest_ppm = std::max(tally.largest_ppm, largest_ppm_);
  tally.square_ppm2 += square_ppm2_;
}

}  // namespace bakewell
