#include "worker/sample/sobol.h"

namespace bakewell {
namespace {

// Primitive polynomials and initial numbers of dimensions 2 to 8: Joe & Kuo 2008, "new-joe-kuo-6.21201".
struct Polynomial {
  int degree;
  uint32_t a;
  std::array<uint32_t, 5> m;
};
constexpr std::array<Polynomial, kSobolDimensions - 1> kPolynomials = {{{1, 0, {1}},
                                                                        {2, 1, {1, 3}},
                                                                        {3, 1, {1, 3, 1}},
                                                                        {3, 2, {1, 1, 1}},
                                                                        {4, 1, {1, 1, 3, 3}},
                                                                        {4, 4, {1, 3, 5, 13}},
                                                                        {5, 2, {1, 1, 5, 5, 17}}}};

using Directions = std::array<uint32_t, 32>;

constexpr Directions MakeDirections(const Polynomial& polynomial) {
  Directions v{};
  const int s = polynomial.degree;
  for (int i = 0; i < s; ++i) v[i] = polynomial.m[i] << (31 - i);
  for (int i = s; i < 32; ++i) {
    v[i] = v[i - s] ^ (v[i - s] >> s);
    for (int k = 1; k < s; ++k) v[i] ^= ((polynomial.a >> (s - 1 - k)) & 1U) * v[i - k];
  }
  return v;
}

// table[byte][value]: for each dimension, XOR of the reversed direction numbers of the bits set in one byte of the
// index.
using Table = std::array<std::array<SobolLanes, 256>, 4>;

const Table kTable = [] {
  Table table{};
  for (int d = 0; d < kSobolDimensions; ++d) {
    Directions directions{};
    for (int i = 0; i < 32; ++i) directions[i] = 1U << (31 - i);
    if (d > 0) directions = MakeDirections(kPolynomials[d - 1]);
    for (int byte = 0; byte < 4; ++byte) {
      for (int value = 0; value < 256; ++value) {
        for (int bit = 0; bit < 8; ++bit) {
          if (value >> bit & 1) table[byte][value][d] ^= ReverseBits(directions[8 * byte + bit]);
        }
      }
    }
  }
  return table;
}();

}  // namespace

SobolLanes SobolReversed(uint32_t index) {
  SobolLanes x = kTable[0][index & 255U] ^ kTable[1][index >> 8 & 255U];
  if (index >> 16) x ^= kTable[2][index >> 16 & 255U] ^ kTable[3][index >> 24];
  return x;
}

}  // namespace bakewell
