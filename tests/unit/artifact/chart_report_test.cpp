#include "core/artifact/chart_report.h"

#include <gtest/gtest.h>

namespace bakewell {
namespace {

TEST(ChartsJson, IsTheExampleOfItsSchema) {
  const ChartSummary chart{0, 1, 1, 33, 25, 768, 0, 3.25, 0.065};
  EXPECT_EQ(
      ChartsJson(0, {&chart, 1}),
      "{\n\"format\": 1,\n\"page\": 0,\n\"charts\": [\n"
      R"({"chart":0,"x0":1,"y0":1,"x1":33,"y1":25,"texels":768,"invalid":0,"irradiance":3.25,"estimated_error":0.02,"error_bound":0.04})"
      "\n]\n}\n");
}

TEST(ChartsJson, WithoutLightThereIsNoRelativeError) {
  const ChartSummary chart{7};
  EXPECT_NE(ChartsJson(3, {&chart, 1}).find("\"estimated_error\":null,\"error_bound\":null"), std::string::npos);
}

}  // namespace
}  // namespace bakewell
