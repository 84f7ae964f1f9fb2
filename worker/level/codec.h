#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/base/status.h"
#include "worker/gather/tile.h"
#include "worker/photon/cache.h"

namespace bakewell {

// What tasks hand to each other, as bytes: little endian, field by field (no padding), the same for equal values.
// Parsers are safe on hostile bytes (kDataLoss).

// Cells without a photon are left out.
std::string SerializePhotons(const PhotonMap& map);
// Adds the photons to a map of `into.flux.size()` cell sides; kDataLoss if they do not fit.
absl::Status AddPhotons(std::string_view bytes, PhotonMap& into);

std::string SerializeCache(const RadianceCache& cache);
absl::StatusOr<RadianceCache> ParseCache(std::string_view bytes);

// The texels of some tiles.
struct GatheredTiles {
  std::vector<TexelLight> lights;
  GatherCounters counters;
};
// The parts one after the other.
std::string SerializeTiles(std::span<const GatheredTiles> parts);
// Appends the texels to `lights`.
absl::StatusOr<GatherCounters> ParseTiles(std::string_view bytes, std::vector<TexelLight>& lights);

}  // namespace bakewell
