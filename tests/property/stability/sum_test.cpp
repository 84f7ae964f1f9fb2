#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "worker/gather/accumulate.h"

// Sums of a million samples against the same in double precision.
namespace bakewell {
namespace {

constexpr uint32_t kSamples = 1 << 20;

// Feeds an accumulator in doubling rounds, as a texel does, and compares.
template <typename Sample>
void ExpectExactSums(Sample sample) {
  Accumulator sum;
  Vec3d irradiance;
  std::array<Vec3d, kShCoefficients> lambda{}, magnitude{};
  uint32_t done = 0;
  for (uint32_t planned = 16; planned <= kSamples; planned *= 2) {
    if (done > 0) sum.Double();
    for (; done < planned; ++done) {
      const auto [dir, radiance] = sample(done);
      sum.Count();
      sum.AddIrradiance(done, planned, radiance);
      sum.AddSh(dir, radiance);
      irradiance += ToDouble(radiance);
      const auto basis = EvaluateSh(dir);
      for (size_t i = 0; i < kShCoefficients; ++i) {
        const Vec3d term = ToDouble(radiance * basis[i]);
        lambda[i] += term;
        magnitude[i] += Vec3d{std::fabs(term.x), std::fabs(term.y), std::fabs(term.z)};
      }
    }
  }
  const RadianceSh sh = sum.Sh();
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(static_cast<double>(sum.Irradiance()[c]) * kSamples / irradiance[c], 1, 1e-5);
    for (size_t i = 0; i < kShCoefficients; ++i) {
      // Against the sum of magnitudes: terms of both signs may cancel.
      EXPECT_NEAR(static_cast<double>(sh.lambda[i][c]) * kSamples, lambda[i][c], 1e-5 * magnitude[i][c]) << i;
    }
  }
}

struct Pair {
  Vec3f dir;
  Rgb radiance;
};

TEST(Sums, AMillionEqualSamplesAreRightToTheFifthDigit) {
  // Symptom: equal addends are rounded the same way every time; 0.1 added up 2^20 times in float is off by a percent.
  ExpectExactSums([](uint32_t) { return Pair{{0.48f, 0.6f, 0.64f}, {0.1f, 1.7f, 3e-5f}}; });
}

TEST(Sums, AMillionSamplesOfSixteenDecadesAreRightToTheFifthDigit) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> decade(-8, 8), angle(0, 6.2831853f), height(-1, 1);
  ExpectExactSums([&](uint32_t) {
    const float z = height(random), phi = angle(random), r = std::sqrt(1 - z * z);
    const float bright = std::pow(10.0f, decade(random));
    return Pair{{r * std::cos(phi), r * std::sin(phi), z}, {bright, 1 / bright, 0.3f}};
  });
}

TEST(Sums, VarianceOfEqualSamplesIsZero) {
  // Blocks that agree to the last bit have no spread; rounding must not make one.
  Accumulator sum;
  for (uint32_t i = 0; i < kSamples; ++i) {
    sum.Count();
    sum.AddIrradiance(i, kSamples, {0.1f, 0.1f, 0.1f});
  }
  EXPECT_LT(sum.Variance().x, 1e-10f * 0.01f);
}

}  // namespace
}  // namespace bakewell
