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

bool PhotonDarkness::IsDark(size_t cell) const { return MaxComponent(cache_.light[2 * cell].irradiance) <= 0; }

bool PhotonDarkness::CoversPlace(const SurfacePoint& point) const {
  const size_t cell = cells_.CellAt(point.triangle, point.position);
  const CellPatch& patch = cells_.patches()[cells_.PatchOf(point.triangle)];
  // A cell that others cut says nothing; one with a narrow window is evidence only where all around it is dark.
  const uint8_t window = cache_.light[2 * cell].window;
  if (window == 0 || !IsDark(cell)) return false;
  const int x = static_cast<int>(cell - patch.first_cell) % patch.width;
  const int y = static_cast<int>(cell - patch.first_cell) / patch.width;
  double area = 0;
  for (int ny = std::max(0, y - kReach); ny <= std::min(patch.height - 1, y + kReach); ++ny) {
    for (int nx = std::max(0, x - kReach); nx <= std::min(patch.width - 1, x + kReach); ++nx) {
      const size_t at = patch.first_cell + static_cast<size_t>(ny) * static_cast<size_t>(patch.width) + nx;
      if (IsDark(at)) {
        area += static_cast<double>(cells_.cells()[at].area * cells_.cells()[at].met[0]);
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
  for (size_t i = 0; i < cache.light.size(); ++i) {
    const SurfaceCell& cell = cells.cells()[i / 2];
    flux += static_cast<double>(Luminance(cache.light[i].irradiance) * cell.area * cell.met[i % 2]);
  }
  return cache.photons_seen > 0 ? static_cast<float>(flux / static_cast<double>(cache.photons_seen)) : 0;
}

float ExpectedIrradiance(const SurfaceCells& cells, const RadianceCache& cache, const TexelMap& map,
                         const Texel& texel) {
  const uint32_t triangle = map.fragments[texel.fragment_begin].triangle;
  return Luminance(cache.light[2 * static_cast<size_t>(cells.CellAt(triangle, texel.position))].irradiance);
}

float DimmestIrradiance(const SurfaceCells& cells, const RadianceCache& cache, const TexelMap& map, uint32_t begin,
                        uint32_t end) {
  float dimmest = std::numeric_limits<float>::infinity();
  for (uint32_t i = begin; i < end; ++i) {
    dimmest = std::min(dimmest, ExpectedIrradiance(cells, cache, map, map.texels[i]));
  }
  return dimmest;
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

void SkipAudit::Found(float lost, float mean, int64_t rays) {
  ++texels_;
  rays_ += rays;
  if (!(lost > 0)) return;
  passes_ = false;
  constexpr float kMost = 1e6f;  // means; no mean is no reason for more
  found_ppm_ = std::max(found_ppm_, std::llround(1e6 * static_cast<double>(lost < kMost * mean ? lost / mean : kMost)));
}

void SkipAudit::Count(SkipTally& tally) const {
  tally.audited += texels_;
  tally.failed_over += passes_ ? 0 : 1;
  tally.found_ppm = std::max<int64_t>(tally.found_ppm, found_ppm_);
}

}  // namespace bakewell
