#include "worker/sample/sobol.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// True where each of the 2^m boxes of 2^-k x 2^-(m-k) holds one of the points [begin, begin + 2^m).
bool IsNet(const SobolSet& set, uint32_t begin, int m, int k) {
  std::vector<int> boxes(size_t{1} << m, 0);
  for (uint32_t i = begin; i < begin + (1u << m); ++i) {
    const SobolPoint point = set.At(i);
    const auto x = static_cast<uint32_t>(point.Get(0) * static_cast<float>(1 << k));
    const auto y = static_cast<uint32_t>(point.Get(1) * static_cast<float>(1 << (m - k)));
    ++boxes[(x << (m - k)) + y];
  }
  return std::all_of(boxes.begin(), boxes.end(), [](int n) { return n == 1; });
}

TEST(Sobol, EveryPowerOfTwoPrefixOfTwoDimensionsIsAZeroNet) {
  for (uint32_t key = 0; key < 20; ++key) {
    const SobolSet set(Hash(key));
    for (int m = 0; m <= 10; ++m) {
      for (int k = 0; k <= m; ++k) EXPECT_TRUE(IsNet(set, 0, m, k)) << "key " << key << " m " << m << " k " << k;
    }
  }
}

TEST(Sobol, EveryAlignedBlockIsAZeroNet) {
  const SobolSet set(77);
  for (const uint32_t block : {1u, 2u, 3u, 1000u}) {
    for (int k = 0; k <= 8; ++k) EXPECT_TRUE(IsNet(set, block << 8, 8, k)) << block << " " << k;
  }
}

TEST(Sobol, EveryDimensionIsStratified) {
  const SobolSet set(5);
  for (int d = 0; d < kSobolDimensions; ++d) {
    std::set<int> strata;
    for (uint32_t i = 0; i < 4096; ++i) strata.insert(static_cast<int>(set.At(i).Get(d) * 4096));
    EXPECT_EQ(strata.size(), 4096u) << d;
  }
}

TEST(Sobol, DimensionsOfOneSetAreUniformInPairs) {
  // 2^14 points in 16 x 16 cells of 64: a digital net of these dimensions (t <= 5) puts exactly 64 in each.
  const SobolSet set(9);
  for (int a = 0; a < kSobolDimensions; ++a) {
    for (int b = 0; b < a; ++b) {
      std::vector<int> cells(256, 0);
      for (uint32_t i = 0; i < (1u << 14); ++i) {
        const SobolPoint point = set.At(i);
        ++cells[static_cast<size_t>(point.Get(a) * 16) * 16 + static_cast<size_t>(point.Get(b) * 16)];
      }
      EXPECT_EQ(*std::min_element(cells.begin(), cells.end()), 64) << a << " " << b;
    }
  }
}

// chi^2 per degree of freedom of dimension `a` of one set against dimension `b` of another at the same index, over
// many pairs of keys.
double JointChiSquare(int a, int b, uint32_t key_step) {
  std::vector<double> cells(256, 0.0);
  constexpr uint32_t kPairs = 400, kPoints = 256;
  for (uint32_t pair = 0; pair < kPairs; ++pair) {
    const uint32_t key = Hash(1000 + pair);
    const SobolSet one(key), other(key + key_step);
    for (uint32_t i = 0; i < kPoints; ++i) {
      ++cells[static_cast<size_t>(one.At(i).Get(a) * 16) * 16 + static_cast<size_t>(other.At(i).Get(b) * 16)];
    }
  }
  const std::vector<double> expected(256, kPairs * kPoints / 256.0);
  return ChiSquareOf(cells, expected).value / 225;  // both margins are fixed
}

TEST(Sobol, SetsOfDifferentKeysShareNoDigits) {
  // Points of two sets at one index had the same leading digits: direct and indirect samples moved together. A set's
  // points come in groups that fill each stratum once, which alone raises chi^2 per degree by at most a factor of 2 (in
  // the first digit: groups of two); shared digits gave above 1000.
  for (const uint32_t key_step : {1u, 2u, 0x9e3779b9u, 0x80000000u}) {
    EXPECT_LT(JointChiSquare(0, 0, key_step), 2) << key_step;
    EXPECT_LT(JointChiSquare(1, 0, key_step), 2) << key_step;
    EXPECT_LT(JointChiSquare(3, 3, key_step), 2) << key_step;
  }
}

}  // namespace
}  // namespace bakewell
