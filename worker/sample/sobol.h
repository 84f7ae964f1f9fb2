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

// A number per dimension: all eight of a point are made at once.
using SobolLanes = uint32_t __attribute__((vector_size(4 * kSobolDimensions)));

// Coordinates of Sobol point `index` before scrambling, bits reversed (first digit in the lowest bit).
SobolLanes SobolReversed(uint32_t index);

// Nested uniform scramble of a number whose first digit is its lowest bit (Laine & Karras 2011 with the constants of
// Vegdahl's improved hash). Lane by lane, where T is SobolLanes.
template <typename T>
constexpr T OwenScrambleReversed(T x, T seed) {
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return x;
}

template <typename T>
constexpr T ReverseBits(T x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffU) << 8) | ((x >> 8) & 0x00ff00ffU);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
  x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
  return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}

// One point of a set. Coordinates are in [0, 1), uniform.
class SobolPoint {
 public:
  SobolPoint(SobolLanes seeds, uint32_t shuffled_index) {
    const SobolLanes bits = ReverseBits(OwenScrambleReversed(SobolReversed(shuffled_index), seeds));
    using Signed = int32_t __attribute__((vector_size(sizeof(SobolLanes))));
    using Floats = float __attribute__((vector_size(sizeof(SobolLanes))));
    coordinate_ = __builtin_convertvector(reinterpret_cast<Signed>(bits >> 8), Floats) * 0x1p-24f;
  }
  float Get(int dimension) const { return coordinate_[dimension]; }
  Vec2f Get2(int dimension) const { return {Get(dimension), Get(dimension + 1)}; }

 private:
  float coordinate_ __attribute__((vector_size(sizeof(SobolLanes))));
};

// The points of a set come in an order of its own (a nested shuffle, which keeps every aligned power-of-two block
// together): without it point i of one set and point i of another would share their leading digits.
class SobolSet {
 public:
  explicit SobolSet(uint32_t key) : key_(key), order_(Hash(key ^ 0x5bd1e995U)) {
    for (int d = 0; d < kSobolDimensions; ++d) seeds_[d] = Hash(key + 0x9e3779b9U * static_cast<uint32_t>(d + 1));
  }
  SobolPoint At(uint32_t index) const {
    return {seeds_, ReverseBits(OwenScrambleReversed(ReverseBits(index), order_))};
  }
  uint32_t key() const { return key_; }

 private:
  uint32_t key_, order_;
  SobolLanes seeds_;
};

}  // namespace bakewell
