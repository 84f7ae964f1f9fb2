#include "server/job/learnt_costs.h"

#include <gtest/gtest.h>

#include "tests/support/temp_dir.h"

namespace bakewell::job {
namespace {

TEST(CostRatio, FollowsTheMedianAndNoOutlier) {
  CostRatio ratio;
  for (int i = 0; i < 40; ++i) ratio.Add(i % 2 == 0 ? 2.9 : 3.1);
  EXPECT_NEAR(ratio.value, 3, 0.2);
  // One task in ten stood still for an hour.
  for (int i = 0; i < 200; ++i) ratio.Add(i % 10 == 0 ? 3600 : i % 2 == 0 ? 2.9 : 3.1);
  EXPECT_NEAR(ratio.value, 3, 0.3);
}

TEST(CostRatio, FirstSampleIsTakenAndBoundsHold) {
  CostRatio slow, fast;
  slow.Add(1e9);
  EXPECT_EQ(slow.value, 100);
  fast.Add(0);
  EXPECT_EQ(fast.value, 0.01);
}

TEST(CostRatio, FollowsAFasterMachineWithinFiftyTasks) {
  CostRatio ratio;
  for (int i = 0; i < 1000; ++i) ratio.Add(4);
  for (int i = 0; i < 50; ++i) ratio.Add(1);
  EXPECT_NEAR(ratio.value, 1, 0.05);
}

TEST(LearntCosts, ComeBackFromTheDatabaseForTheirVersionOnly) {
  const TempDir dir{"/dev/shm"};
  const std::vector<plan::Kind> kinds = {{"a", 1}, {"b", 2}};
  store::Writer writer(store::Tables::Open(dir / "farm.db").value());
  LearntCosts before(kinds);
  for (int i = 0; i < 5; ++i) before.Learn(0, 7, 9, writer);
  before.Learn(1, 2, 3, writer);
  ASSERT_TRUE(writer.Run([](store::Tables&) { return absl::OkStatus(); }).ok());

  const auto reader = store::Tables::OpenReadOnly(dir / "farm.db").value();
  LearntCosts after({{"b", 2}, {"a", 2}});
  double told = 0;
  ASSERT_TRUE(after.Load(*reader, [&](int, double lease_ratio) { told += lease_ratio; }).ok());
  EXPECT_EQ(after.RunRatio(0), 2);
  EXPECT_EQ(after.RunRatio(1), 1) << "another version of the code has other costs";
  EXPECT_EQ(told, 3);
  EXPECT_EQ(after.KindOf({"a", 2, "", {}}), 1);
  EXPECT_EQ(after.KindOf({"a", 1, "", {}}), -1);
}

}  // namespace
}  // namespace bakewell::job
