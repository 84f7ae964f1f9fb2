#include "worker/gather/guide.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr Frame kUp{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

TEST(GatherGuide, CellsAreThoseOfThePrimarySquare) {
  TestRandom random(1);
  for (int i = 0; i < 10000; ++i) {
    const Vec2f u{random.Unit(), random.Unit()};
    const float row = u.x * GatherGuide::kRows, column = u.y * GatherGuide::kColumns;
    if (std::fabs(row - std::round(row)) < 1e-3f || std::fabs(column - std::round(column)) < 1e-3f) continue;
    EXPECT_EQ(GatherGuide::CellOf(GatherHemisphere(u)),
              static_cast<size_t>(row) * GatherGuide::kColumns + static_cast<size_t>(column));
  }
}

TEST(GatherGuide, DensityIsThatOfItsSamples) {
  TestRandom random(2);
  std::array<float, GatherGuide::kCells> weight{};
  double sum = 0;
  for (float& w : weight) {
    w = 0.01f + std::pow(random.Unit(), 4.0f);
    sum += static_cast<double>(w);
  }
  const GatherGuide guide(weight);
  constexpr int kSamples = 1 << 18;
  const SobolSet set(3);
  std::array<double, GatherGuide::kCells> count{};
  for (int i = 0; i < kSamples; ++i) {
    const GatherGuide::Sample sample = guide.Draw(set.At(static_cast<uint32_t>(i)).Get2(0));
    const size_t row = static_cast<size_t>(sample.primary.x * GatherGuide::kRows);
    const size_t cell = row * GatherGuide::kColumns + static_cast<size_t>(sample.primary.y * GatherGuide::kColumns);
    ASSERT_LT(cell, weight.size());
    EXPECT_NEAR(guide.Density(GatherHemisphere(sample.primary)), sample.density, 1e-5f * sample.density);
    EXPECT_NEAR(static_cast<double>(sample.density), static_cast<double>(weight[cell]) * GatherGuide::kCells / sum,
                1e-3);
    count[cell] += 1.0 / kSamples;
  }
  for (size_t i = 0; i < count.size(); ++i) EXPECT_NEAR(count[i], static_cast<double>(weight[i]) / sum, 1e-4) << i;
}

TEST(GatherGuide, EndsOfTheSquareStayInside) {
  std::array<float, GatherGuide::kCells> weight{};
  weight.fill(1e-6f);
  weight.back() = 1;
  const GatherGuide guide(weight);
  for (const float u : {0.0f, 0x1.fffffep-1f}) {
    const GatherGuide::Sample sample = guide.Draw({u, u});
    EXPECT_GT(sample.density, 0);
    EXPECT_LT(sample.primary.x, 1);
    EXPECT_LT(sample.primary.y, 1);
  }
}

// Rays of a texel at the origin under a bright disc at `place`, seen under an angle of 0.2 rad, and a dim sky.
FoundLight LookAround(Vec3f place, float sky, int rays) {
  FoundLight found;
  TestRandom random(4);
  for (int i = 0; i < rays; ++i) {
    const Vec3f dir = GatherHemisphere({random.Unit(), random.Unit()});
    const bool bright = Dot(dir, NormalizeOrZero(place)) > std::cos(0.2f);
    found.Add(bright ? dir * Length(place) : dir, !bright, bright ? 50.0f : sky, 1);
  }
  found.Resample(rays, 0.5f);
  return found;
}

TEST(FoundLight, GuidesRaysToIt) {
  const Vec3f place{1, 2, 2};
  const FoundLight found = LookAround(place, 1, 4000);
  // From elsewhere the light lies in another direction.
  for (const Vec3f from : {Vec3f{0, 0, 0}, Vec3f{1, 0, 0}, Vec3f{0, -1, 0}}) {
    const auto guide = found.GuideAt(from, kUp);
    ASSERT_TRUE(guide.has_value());
    const SobolSet set(5);
    int at_light = 0, unguided = 0;
    double mean = 0;
    constexpr int kSamples = 4096;
    const auto meets = [&](Vec2f u) {
      return Dot(GatherHemisphere(u), NormalizeOrZero(place - from)) > std::cos(0.2f);
    };
    for (uint32_t i = 0; i < kSamples; ++i) {
      const Vec2f u = set.At(i).Get2(0);
      const GatherGuide::Sample sample = guide->Draw(u);
      at_light += meets(sample.primary) ? 1 : 0;
      unguided += meets(u) ? 1 : 0;
      mean += (meets(sample.primary) ? 1.0 : 0.0) / static_cast<double>(sample.density) / kSamples;
    }
    EXPECT_GT(at_light, 3 * unguided);
    EXPECT_NEAR(mean, static_cast<double>(unguided) / kSamples, 0.1 * unguided / kSamples) << "unbiased";
  }
}

// Rays that were aimed at the light count by their density: the guide is that of rays that were not.
TEST(FoundLight, LearnsTheSameFromRaysThatWereAimed) {
  const Vec3f place{1, 2, 2};
  constexpr int kRays = 40000;
  constexpr float kAimed = 0.4f;
  // Aimed rays go to the disc alone, uniform by the primary square.
  TestRandom random(9);
  const auto meets = [&](Vec3f dir) { return Dot(dir, NormalizeOrZero(place)) > std::cos(0.2f); };
  int inside = 0;
  for (int i = 0; i < kRays; ++i) inside += meets(GatherHemisphere({random.Unit(), random.Unit()})) ? 1 : 0;
  const float density_inside = 1 - kAimed + kAimed * kRays / static_cast<float>(inside);
  FoundLight found;
  for (int i = 0; i < kRays; ++i) {
    const bool aimed = random.Unit() < kAimed;
    Vec3f dir;
    do dir = GatherHemisphere({random.Unit(), random.Unit()});
    while (aimed && !meets(dir));
    const bool bright = meets(dir);
    const float density = bright ? density_inside : 1 - kAimed;
    found.Add(bright ? dir * Length(place) : dir, !bright, (bright ? 50.0f : 1.0f) / density, density);
  }
  found.Resample(kRays, 0.5f);
  const auto aimed = found.GuideAt({}, kUp), unaimed = LookAround(place, 1, kRays).GuideAt({}, kUp);
  ASSERT_TRUE(aimed && unaimed);
  for (int i = 0; i < 64; ++i) {
    const Vec3f dir =
        GatherHemisphere({(static_cast<float>(i / 8) + 0.5f) / 8, (static_cast<float>(i % 8) + 0.5f) / 8});
    EXPECT_NEAR(aimed->Density(dir) / unaimed->Density(dir), 1, 0.25f) << i;
  }
}

TEST(FoundLight, GuidesNobodyWhereAllDirectionsAreAlike) {
  EXPECT_FALSE(LookAround({0, 0, 1}, 50, 4000).GuideAt({}, kUp).has_value());
  FoundLight nothing;
  nothing.Resample(0, 0.5f);
  EXPECT_FALSE(nothing.GuideAt({}, kUp).has_value());
}

// Light so far away that the distance is beyond what floats hold: its direction is no number, and no cell.
TEST(FoundLight, DirectionsThatAreNoNumbersStayInTheTable) {
  FoundLight found;
  for (int i = 0; i < 64; ++i) found.Add({3e38f, 3e38f, 3e38f}, false, 1, 1);
  found.Resample(64, 0.5f);
  const float s = 1 / std::sqrt(3.0f), r = 1 / std::sqrt(2.0f);
  const Frame diagonal{{r, -r, 0}, {s * r, s * r, -2 * s * r}, {s, s, s}};
  if (const auto guide = found.GuideAt({0, 0, 0}, diagonal)) {
    const GatherGuide::Sample sample = guide->Draw({0.5f, 0.5f});
    EXPECT_TRUE(std::isfinite(sample.density));
    EXPECT_GT(sample.density, 0);
  }
  EXPECT_LT(GatherGuide::CellOf({0, 0, std::nanf("")}), size_t{GatherGuide::kCells});
}

}  // namespace
}  // namespace bakewell
