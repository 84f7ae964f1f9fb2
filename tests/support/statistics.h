#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <span>

#include "core/math/vec.h"

namespace bakewell {

// Random numbers for tests that owe nothing to the code under test. Same seed, same numbers.
class TestRandom {
 public:
  explicit TestRandom(uint32_t seed) : engine_(seed) {}
  float Unit() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }  // [0, 1)
  float Between(float low, float high) { return low + (high - low) * Unit(); }
  Vec2f Square() {
    const float x = Unit();
    return {x, Unit()};
  }
  Vec3f InCube(float half) {
    const float x = Between(-half, half), y = Between(-half, half);
    return {x, y, Between(-half, half)};
  }
  // Uniform on the sphere, by rejection.
  Vec3f Direction() {
    while (true) {
      const Vec3f p = InCube(1);
      if (Dot(p, p) <= 1 && Dot(p, p) > 1e-4f) return NormalizeOrZero(p);
    }
  }

 private:
  std::mt19937 engine_;
};

// Pearson's statistic of counts against expected counts. Cells that expect fewer than 5 are pooled into one.
struct ChiSquare {
  double value = 0;
  int degrees = -1;

  void Add(double observed, double expected) {
    value += (observed - expected) * (observed - expected) / expected;
    ++degrees;
  }
  // Standard deviations above what chance gives (Wilson & Hilferty 1931). Tests have fixed seeds and ask for less than
  // 4: a right sampler passes 30,000 of 30,001 seeds.
  double Z() const {
    const double k = 2.0 / (9.0 * degrees);
    return (std::cbrt(value / degrees) - (1 - k)) / std::sqrt(k);
  }
};

inline ChiSquare ChiSquareOf(std::span<const double> observed, std::span<const double> expected) {
  ChiSquare result;
  double rest_observed = 0, rest_expected = 0;
  for (size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] >= 5) {
      result.Add(observed[i], expected[i]);
    } else {
      rest_observed += observed[i];
      rest_expected += expected[i];
    }
  }
  if (rest_expected > 0) result.Add(rest_observed, rest_expected);
  return result;
}

}  // namespace bakewell
