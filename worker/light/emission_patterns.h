#pragma once

#include <cstdint>
#include <vector>

#include "worker/light/emission_table.h"
#include "worker/trace/world.h"

namespace bakewell {

// How the triangles of a world glow. Those with the same material and texture coordinates, the lamps of a street or
// the windows of a tower, are one pattern. All tables take at most 64 MB together. Made on all threads.
class EmissionPatterns {
 public:
  explicit EmissionPatterns(const World& world);

  struct Emitter {
    uint32_t triangle = 0;
    Rgb mean{};      // radiance of what glows, the front or both sides [W m^-2 sr^-1]
    int table = -1;  // of tables(); -1: it glows evenly, about, or too many others want one
  };
  // Those that glow at all, in the world's order.
  const std::vector<Emitter>& emitters() const { return emitters_; }
  const EmissionTable& table(int i) const { return tables_[static_cast<size_t>(i)]; }

 private:
  std::vector<Emitter> emitters_;
  std::vector<EmissionTable> tables_;
};

}  // namespace bakewell
