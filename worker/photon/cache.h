#pragma once

#include <array>
#include <vector>

#include "core/artifact/progress.h"
#include "core/artifact/skip.h"
#include "worker/photon/emit.h"

namespace bakewell {

// Irradiance of one side of one cell, estimated from photons [W m^-2].
struct CellIrradiance {
  Rgb direct;    // straight from lights
  Rgb indirect;  // after at least one bounce
};

// The photon map as the gather reads it: O(1) per look-up. Element 2 * cell + side.
struct RadianceCache {
  std::vector<CellIrradiance> irradiance;
  // Per group: luminance of irradiance (direct + indirect) as that eighth of the photons sees it, for the variance.
  std::vector<std::array<float, kVarianceGroups>> group;
  // Side of the neighbourhood that was averaged, in cells (1, 3, 5, ...); 0: the cell is cut by other geometry, part of
  // it may lie behind a wall, and its value is no evidence.
  std::vector<uint8_t> window;
  int64_t photons_seen = 0;
  int64_t rays = 0;
  SkipCount unfaced_backs;  // sides of cells whose patch no photon met, of those with surface; rays
};

struct DensityOptions {
  int target_count = 24;     // photons a neighbourhood should hold
  int max_radius = 3;        // cells
  bool probe_unlit = false;  // search the neighbourhoods of sides that no photon met as well
};

// E ~ sum of flux / sum of exact area over the smallest square neighbourhood that holds target_count photons and that
// can be reached from the cell without passing through geometry (short rays between cell centres), inside the cell's
// patch.
RadianceCache EstimateDensity(const World& world, const SurfaceCells& cells, const PhotonMap& map,
                              const PhotonPlan& plan, const DensityOptions& options, Progress& progress);

}  // namespace bakewell
