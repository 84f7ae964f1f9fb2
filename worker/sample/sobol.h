#pragma once

#include <array>
#include <cstdint>

#include "core/math/vec.h"
#include "worker/sample/hash.h"

namespace bakewell {

// Owen-scrambled Sobol points. A Sampler is one point set of up to kSobolDimensions dimensions: point `index` of the
// set keyed `key`. Sets with different keys are independent (padding, Burley 2020, "Practical Hash-based Owen
// Scrambling"). Any power-of-two prefix of a set is a (t, m, s)-net.
inline constexpr int kSobolDimensions = 8;

// Coordinate of Sobol point `index` before scrambling, bits reversed (first digit in the lowest bit).
uint32_t SobolReversed(uint32_t index, int dimension);

// Nested uniform scramble of a number whose first digit is its lowest bit (Laine & Karras 2011 with the constants of
// Vegdahl's improved hash).
constexpr uint32_t OwenScrambleReversed(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return x;
}

constexpr uint32_t ReverseBits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
  x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
  return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}

// One point of a set. Coordinates are in [0, 1), uniform.
class SobolPoint {
 public:
  SobolPoint(const std::array<uint32_t, kSobolDimensions>& seeds, uint32_t shuffled_index)
      : seeds_(seeds), index_(shuffled_index) {}
  float Get(int dimension) const {
    return UnitFloat(ReverseBits(OwenScrambleReversed(SobolReversed(index_, dimension), seeds_[dimension])));
  }
  Vec2f Get2(int dimension) const { return {Get(dimension), Get(dimension + 1)}; }

 private:
  const std::array<uint32_t, kSobolDimensions>& seeds_;
  uint32_t index_;
};

// The points of a set come in an order of its own (a nested shuffle, which keeps every aligned power-of-two block
// together): without it point i of one set and point i of another would share their leading digits.
class SobolSet {
 public:
  explicit SobolSet(uint32_t key) : key_(key) {
    for (int d = 0; d < kSobolDimensions; ++d) seeds_[d] = Hash(key + 0x9e3779b9U * static_cast<uint32_t>(d + 1));
  }
  // The set must outlive the point.
  SobolPoint At(uint32_t index) const {
    return {seeds_, ReverseBits(OwenScrambleReversed(ReverseBits(index), Hash(key_ ^ 0x5bd1e995U)))};
  }
  uint32_t key() const { return key_; }

 private:
  uint32_t key_;
  std::array<uint32_t, kSobolDimensions> seeds_;
};

}  // namespace bakewell
