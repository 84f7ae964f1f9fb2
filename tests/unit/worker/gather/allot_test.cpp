#include "worker/gather/allot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/statistics.h"

namespace bakewell {
namespace {

double Sum(std::span<const Claim> claims) {
  double sum = 0;
  for (const Claim& claim : claims) sum += static_cast<double>(claim.error);
  return sum;
}

std::vector<bool> Granted(const std::vector<Claim>& claims, size_t texels) {
  double nothing_to_spare = 0;
  return Allot({claims, texels}, nothing_to_spare);
}

TEST(Allot, GrantsNothingWhereAllTogetherIsEnough) {
  // A penumbra above what is tolerated, on a plain that has less than it may.
  std::vector<Claim> claims(100, {0.2f, 8, 6});
  claims[7].error = 3;
  EXPECT_EQ(Granted(claims, 100), std::vector<bool>(100, false));
}

// Symptom: half of a sunlit level's squared error lay on a hundredth of its texels, shadows' edges.
TEST(Allot, WhatCanBeSparedGoesToThoseThatGainMost) {
  std::vector<Claim> claims(100, {.error = 0.2f, .cost = 8, .doublings = 6, .spared_for = true});
  claims[7].error = claims[8].error = claims[9].error = 3;
  claims[8].cost = 4;
  claims[5].error = 50;  // of what nothing is spared for
  claims[5].spared_for = false;
  claims[5].doublings = 0;
  claims[5].further = 1;
  double spare = 13;
  const std::vector<bool> granted = Allot({claims, 100}, spare);
  EXPECT_TRUE(granted[8] && (granted[7] || granted[9]));
  EXPECT_EQ(std::count(granted.begin(), granted.end(), true), 2);
  EXPECT_EQ(spare, 1);
}

TEST(Allot, NothingIsSpentWhereAllGainLittle) {
  double spare = 1000;
  const Claim little{.error = 0.04f, .cost = 8, .doublings = 6, .spared_for = true};
  EXPECT_EQ(Allot({std::vector<Claim>(100, little), 100}, spare), std::vector<bool>(100, false));
  EXPECT_EQ(spare, 1000);
}

TEST(Allot, NobodyStaysFarAboveWhatIsTolerated) {
  std::vector<Claim> claims(100, {0.1f, 8, 6});
  claims[7].error = 1.01f * kWorst * kWorst;
  const std::vector<bool> granted = Granted(claims, 100);
  EXPECT_EQ(std::count(granted.begin(), granted.end(), true), 1);
  EXPECT_TRUE(granted[7]);
}

// Symptom: one texel at its most samples that still strayed made all others of its tile take theirs.
TEST(Allot, NobodyMakesUpForWhatCannotBeMended) {
  std::vector<Claim> claims(100, {0.5f, 8, 6});
  claims[7] = {1e30f, 4096, 0};
  EXPECT_EQ(Granted(claims, 100), std::vector<bool>(100, false));
}

TEST(Allot, TheGreatestGainForItsCostComesFirst) {
  const std::vector<Claim> claims = {{2, 64, 6}, {2, 8, 6}, {1, 8, 6}, {1, 8, 0}};
  // 6 in all; 4.75 is the aim of 5: two doublings that bring 1 and 0.5.
  EXPECT_EQ(Granted(claims, 5), (std::vector<bool>{false, true, true, false}));
}

// Symptom: a penumbra far above what its tile may have made the plain around it double with it, round after round.
TEST(Allot, WhoWillNotBeNeededWaits) {
  std::vector<Claim> claims(100, {0.9f, 8, 6});
  claims[7].error = 40;
  const std::vector<bool> granted = Granted(claims, 100);
  EXPECT_TRUE(granted[7]);
  EXPECT_EQ(std::count(granted.begin(), granted.end(), true), 1);
}

TEST(Allot, WeightsCountInTheSumAndNotForTheWorst) {
  std::vector<Claim> claims(100, {0.2f, 8, 6});
  claims[7] = {1.5f, 8, 6, 0, 50};
  claims[8] = {1.5f, 8, 6};
  const std::vector<bool> granted = Granted(claims, 90);
  EXPECT_TRUE(granted[7]);
  EXPECT_EQ(std::count(granted.begin(), granted.end(), true), 1);
  EXPECT_EQ(Granted(claims, 100), std::vector<bool>(100, false));
}

// Symptom: texels at the most samples that one texel's error may ask for stayed at three times what their tile may
// have.
TEST(Allot, BeyondItsOwnDoublingsAClaimGoesOnForTheSum) {
  std::vector<Claim> claims(100, {0.1f, 8, 6});
  claims[7] = {2 * kWorst * kWorst, 4096, 0, 6};
  EXPECT_EQ(Granted(claims, 100), std::vector<bool>(100, false));
  claims[7].error = 200;
  EXPECT_TRUE(Granted(claims, 100)[7]);
}

TEST(Allot, BeyondTheirOwnDoublingsClaimsEndAtTheCeiling) {
  std::vector<Claim> claims(10, {100, 64, 0, 6});
  claims[3].doublings = 1;
  claims[4].error = 200;
  double nothing_to_spare = 0;
  const auto granted = [&](double ceiling) { return Allot({claims, 10, ceiling}, nothing_to_spare); };
  const std::vector<bool> two = granted(640 + 2 * 64);
  EXPECT_TRUE(two[3] && two[4]);
  EXPECT_EQ(std::count(two.begin(), two.end(), true), 2);
  const std::vector<bool> own = granted(100);
  EXPECT_TRUE(own[3]);
  EXPECT_EQ(std::count(own.begin(), own.end(), true), 1);
}

// Doubling by doubling towards a sum of errors costs at most half more than the least cost there is, sqrt(error x cost)
// shared out without whole doublings (Neyman), and ends.
TEST(Allot, CostsLittleMoreThanTheOptimum) {
  TestRandom random(3);
  std::vector<Claim> claims;
  for (int i = 0; i < 1000; ++i) claims.push_back({std::exp(4 * random.Unit() - 3), 8, 20});
  const double floor_cost = 8 * 1000, budget = 0.1 * Sum(claims);
  double roots = 0;
  for (const Claim& claim : claims) roots += std::sqrt(static_cast<double>(claim.error) * 8);
  int rounds = 0;
  for (; Sum(claims) > budget; ++rounds) {
    // Errors in units in which 1 is tolerated: the budget is that of `budget` texels.
    const std::vector<bool> granted = Granted(claims, static_cast<size_t>(budget));
    ASSERT_NE(std::count(granted.begin(), granted.end(), true), 0);
    for (size_t i = 0; i < claims.size(); ++i) {
      if (!granted[i]) continue;
      claims[i].error /= 2;
      claims[i].cost *= 2;
    }
  }
  double cost = 0;
  for (const Claim& claim : claims) cost += static_cast<double>(claim.cost);
  EXPECT_GT(cost, floor_cost);
  EXPECT_LT(cost, 1.5 * roots * roots / budget);
  EXPECT_LT(rounds, 20);
}

TEST(Allot, IsMetWhereNothingIsGranted) {
  TestRandom random(5);
  for (int turn = 0; turn < 1000; ++turn) {
    std::vector<Claim> claims;
    for (int i = 0; i < 20; ++i) {
      claims.push_back({2.2f * random.Unit() * random.Unit(), 8, random.Unit() < 0.3f ? 0 : 3});
      if (random.Unit() < 0.02f) claims.back().error = 9;
      if (random.Unit() < 0.3f) claims.back().further = 2;
      if (random.Unit() < 0.3f) claims.back().weight = 2;
    }
    const size_t texels = turn % 2 == 0 ? 10 : 40;  // at 40 only what is urgent is granted anything
    const Demand demand{claims, texels, turn % 3 == 0 ? 155.0 : 1000.0};
    double nothing_to_spare = 0;
    const std::vector<bool> granted = Allot(demand, nothing_to_spare);
    EXPECT_EQ(IsMet(demand), std::count(granted.begin(), granted.end(), true) == 0) << turn;
  }
}

}  // namespace
}  // namespace bakewell
