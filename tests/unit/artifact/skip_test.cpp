#include "core/artifact/skip.h"

#include <gtest/gtest.h>

namespace bakewell {
namespace {

TEST(SkipSet, NamesAreSwitchedAndOthersRefused) {
  const std::vector<std::string> two = {"dark_charts", "sh_bands"}, all = {"all"}, wrong = {"dark"};
  const SkipSet set = SkipSetOf(two).value();
  EXPECT_TRUE(set.Has(Skip::kDarkCharts) && set.Has(Skip::kShBands));
  EXPECT_FALSE(set.Has(Skip::kNoLight));
  EXPECT_EQ(SkipSetOf(all).value(), SkipSet::All());
  const absl::Status refused = SkipSetOf(wrong).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(refused.message()).find("culled_lights"), std::string::npos);
}

TEST(SkipTally, BytesBringItBackAndSumsDoNotDependOnTheOrder) {
  SkipTally a, b;
  a[Skip::kNoLight] = {1, 2, 3};
  a.audited = 5;
  a.found_ppm = 10;
  b[Skip::kUnfacedBacks] = {7, 8, 9};
  b.failed_over = 2;
  b.found_ppm = 30;
  SkipTally ab = a, ba = b;
  ab.Add(b);
  ba.Add(a);
  EXPECT_EQ(Serialize(ab), Serialize(ba));
  EXPECT_EQ(Serialize(ParseSkipTally(Serialize(ab)).value()), Serialize(ab));
  EXPECT_EQ(ab.found_ppm, 30);
  EXPECT_EQ(ab[Skip::kUnfacedBacks].of, 8);
  const std::string bytes = Serialize(ab);
  for (size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(ParseSkipTally(bytes.substr(0, size)).ok()) << size;
  EXPECT_FALSE(ParseSkipTally(bytes + "x").ok());
}

}  // namespace
}  // namespace bakewell
