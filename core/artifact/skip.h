#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace bakewell {

// What a bake may leave out because it cannot matter (worker/README.md says when, and what it saves).
enum class Skip : uint8_t {
  kNoLight,        // everything, where nothing shines
  kDarkCharts,     // texels that the photons say no light reaches
  kCulledLights,   // lights that cannot bring a tile more than a share of the target
  kShBands,        // bands of spherical harmonics below the target
  kOpaqueAlpha,    // alpha look-ups on triangles that are opaque all over
  kUnseenSky,      // rays to suns and sky from tiles that see no sky
  kInvalidTexels,  // light of texels inside solids, and the search for parts of them that are outside
  kUnfacedBacks,   // sides of surfaces that no photon met
};
inline constexpr std::array<const char*, 8> kSkipNames = {"no_light",       "dark_charts",  "culled_lights",
                                                          "sh_bands",       "opaque_alpha", "unseen_sky",
                                                          "invalid_texels", "unfaced_backs"};

// Kinds that are switched off.
class SkipSet {
 public:
  bool Has(Skip skip) const { return bits_ >> static_cast<int>(skip) & 1; }
  void Add(Skip skip) { bits_ |= 1U << static_cast<int>(skip); }
  static SkipSet All();
  bool operator==(const SkipSet&) const = default;

 private:
  uint32_t bits_ = 0;
};

// Of kSkipNames, or "all"; kInvalidArgument, listing them, for anything else.
absl::StatusOr<SkipSet> SkipSetOf(std::span<const std::string> names);

// How much of a kind was left out.
struct SkipCount {
  int64_t skipped = 0, of = 0;  // in the kind's own unit (schema/manifest.md)
  int64_t saved = 0;            // rays, as audited texels tell or are known to be saved at least
  void Add(const SkipCount& other) {
    skipped += other.skipped;
    of += other.of;
    saved += other.saved;
  }
};

// What all kinds left out, and what the audit of it found: texels that were to be skipped, drawn by lot, computed in
// full. Sums of integers: the same for any order and number of tasks.
struct SkipTally {
  std::array<SkipCount, kSkipNames.size()> kind;
  int64_t audited = 0, failed_over = 0;  // texels; tiles that were computed again without skipping
  // The largest luminance that skipping would have lost in an audited texel, over the mean of the bake, in parts per
  // million.
  int64_t found_ppm = 0;

  SkipCount& operator[](Skip skip) { return kind[static_cast<size_t>(skip)]; }
  void Add(const SkipTally& other);
};

// Canonical bytes and back; the parser is safe on hostile bytes (kDataLoss).
std::string Serialize(const SkipTally& tally);
absl::StatusOr<SkipTally> ParseSkipTally(std::string_view bytes);

}  // namespace bakewell
