#include <gtest/gtest.h>

#include <sstream>
#include <thread>
#include <vector>

#include "client/cli/progress_display.h"
#include "client/cli/progress_estimate.h"

namespace bakewell {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::seconds;

const ProgressEstimate::Time kStart{seconds(1000)};

TEST(ProgressEstimate, SteadyGatherGivesTheTimeLeftWithinTheLaterPhasesShare) {
  ProgressEstimate estimate;
  estimate.Report("gather", 0, 100, kStart);
  estimate.Report("gather", 25, 100, kStart + seconds(25));
  // 75 s of the gather at its own speed; finish and write are 5 % of a whole of which 100 s are 95 %.
  EXPECT_NEAR(estimate.TimeLeft(kStart + seconds(25))->count(), 75 + 100 * 0.05 / 0.95, 1e-9);
}

// Symptom: the bar stood still while --density signal baked its preview.
TEST(ProgressEstimate, PreviewMovesTheBarAndLeavesRoomForTheRest) {
  ProgressEstimate estimate;
  estimate.Report("texels", 1, 1, kStart);
  const double before = estimate.Fraction();
  estimate.Report("preview", 0, 10, kStart);
  estimate.Report("preview", 5, 10, kStart + seconds(5));
  EXPECT_GT(estimate.Fraction(), before);
  const auto left = estimate.TimeLeft(kStart + seconds(5));
  ASSERT_TRUE(left.has_value());
  EXPECT_GT(left->count(), 5) << "the bake itself comes after it";
  estimate.Report("write", 1, 1, kStart + seconds(60));
  EXPECT_NEAR(estimate.Fraction(), 1, 1e-12);
}

TEST(ProgressEstimate, SaysNothingBeforeThereIsEvidence) {
  ProgressEstimate estimate;
  estimate.Report("gather", 0, 1000, kStart);
  estimate.Report("gather", 500, 1000, kStart + milliseconds(900));
  EXPECT_FALSE(estimate.TimeLeft(kStart + milliseconds(900)).has_value());
  estimate.Report("finish", 1, 1000, kStart + seconds(5));
  EXPECT_FALSE(estimate.TimeLeft(kStart + seconds(5)).has_value());
  estimate.Report("a new phase", 500, 1000, kStart + seconds(6));
  EXPECT_FALSE(estimate.TimeLeft(kStart + seconds(6)).has_value());
}

TEST(ProgressEstimate, FractionNeverFallsAndEndsAtOne) {
  ProgressEstimate estimate;
  double last = 0;
  for (const char* const phase : {"chart", "texels", "gather", "photons", "finish", "write"}) {
    for (const int done : {0, 5, 3, 10}) {
      estimate.Report(phase, done, 10, kStart);
      EXPECT_GE(estimate.Fraction(), last);
      last = estimate.Fraction();
    }
  }
  EXPECT_NEAR(last, 1, 1e-12);
}

TEST(ProgressEstimate, APhaseWithoutWorkIsNoError) {
  ProgressEstimate estimate;
  estimate.Report("gather", 0, 0, kStart);
  EXPECT_FALSE(estimate.TimeLeft(kStart + seconds(9)).has_value());
}

TEST(DurationText, IsShort) {
  EXPECT_EQ(DurationText(duration<double>(0.2)), "1 s");
  EXPECT_EQ(DurationText(duration<double>(125)), "2 min 05 s");
  EXPECT_EQ(DurationText(duration<double>(3725)), "1 h 02 min");
}

size_t LineCount(const std::string& text) { return static_cast<size_t>(std::count(text.begin(), text.end(), '\n')); }

TEST(ProgressDisplay, PlainLinesAreFewHoweverManyReports) {
  std::ostringstream stream;
  ProgressDisplay display(stream, ProgressStyle::kLines);
  for (int i = 0; i <= 10000; ++i) display.Report("gather", i, 10000);
  EXPECT_LE(LineCount(stream.str()), 10u);
  EXPECT_NE(stream.str().find("gather    90 %"), std::string::npos) << stream.str();
}

TEST(ProgressDisplay, ReportsFromManyThreadsKeepLinesWhole) {
  std::ostringstream stream;
  {
    ProgressDisplay display(stream, ProgressStyle::kJson);
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&display] {
        for (int i = 0; i < 500; ++i) display.Report("gather", 500, 500);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  EXPECT_EQ(LineCount(stream.str()), 2000u);
  std::istringstream lines(stream.str());
  for (std::string line; std::getline(lines, line);) {
    ASSERT_EQ(line.rfind("{\"event\":\"progress\"", 0), 0u) << line;
    ASSERT_EQ(line.back(), '}');
  }
}

TEST(ProgressDisplay, TheBarIsRedrawnOnOneLineThatEndsWithIt) {
  std::ostringstream stream;
  {
    ProgressDisplay display(stream, ProgressStyle::kBar);
    display.Report("chart", 1, 1);
    display.Report("gather", 10, 10);
    EXPECT_EQ(LineCount(stream.str()), 0u);
  }
  EXPECT_EQ(LineCount(stream.str()), 1u);
  EXPECT_NE(stream.str().find("\rgather   [############################..]  95 %"), std::string::npos) << stream.str();
}

}  // namespace
}  // namespace bakewell
