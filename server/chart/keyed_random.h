#pragma once

#include <cstdint>

namespace bakewell::chart {

// A number in [-1, 1) from a pair of keys.
inline double KeyedRandom(uint32_t a, uint32_t b) {
  uint64_t h = (uint64_t{a} << 32 | b) * 0x9E3779B97F4A7C15ull;
  h ^= h >> 32;
  h *= 0xD6E8FEB86659FD93ull;
  h ^= h >> 32;
  return double(h >> 11) * 0x1p-52 - 1;
}

// The length of a step between two faces for Dijkstra's algorithm, off by up to half a percent: on a regular mesh many
// paths are equally long, and the rounding of the input, another at every scale of the mesh, would choose among them.
inline double UntiedStep(double length, uint32_t f, uint32_t g) {
  return length * (1 + 0.005 * (f < g ? KeyedRandom(f, g) : KeyedRandom(g, f)));
}

}  // namespace bakewell::chart
