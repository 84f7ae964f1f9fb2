#pragma once

#include <cstdint>

// Keyed randomness: every random number is a pure function of what it is for, never the next of a stream.
namespace bakewell {

// A bijection of 32 bits with good avalanche (Wellons, "lowbias32").
constexpr uint32_t Hash(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  x ^= x >> 16;
  return x;
}

constexpr uint32_t HashCombine(uint32_t a, uint32_t b) {
  return Hash(a ^ (Hash(b) + 0x9e3779b9U + (a << 6) + (a >> 2)));
}

// 64 bits to 32, for counters that may pass 2^32.
constexpr uint32_t HashWide(uint64_t x) {
  x ^= x >> 33;
  x *= 0xff51afd7ed558ccdULL;
  x ^= x >> 33;
  x *= 0xc4ceb9fe1a85ec53ULL;
  x ^= x >> 33;
  return static_cast<uint32_t>(x >> 32);
}

// [0, 1), 24 bits.
constexpr float UnitFloat(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

}  // namespace bakewell
