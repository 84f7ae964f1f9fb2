#include "worker/finish/charts.h"

#include <gtest/gtest.h>

namespace bakewell {
namespace {

TEST(SummarizeCharts, CountsEachChartOfThePageAndLeavesInvalidTexelsOut) {
  TexelMap map;
  map.pages = {{8, 8}, {8, 8}};
  std::vector<TexelLight> lights;
  const auto add = [&](int16_t page, int chart, int x, int y, float light, float variance, bool valid) {
    Texel texel;
    texel.page = page;
    texel.chart = chart;
    texel.x = x;
    texel.y = y;
    map.texels.push_back(texel);
    TexelLight result;
    result.irradiance = {light, light, light};
    result.variance = {variance, variance, variance};
    result.valid = valid;
    lights.push_back(result);
  };
  add(0, 4, 2, 3, 1, 0.01f, true);
  add(0, 4, 5, 1, 3, 0.03f, true);
  add(0, 4, 6, 6, 100, 9, false);
  add(0, 2, 0, 0, 0, 0, true);
  add(1, 4, 7, 7, 5, 1, true);
  const std::vector<ChartSummary> charts = SummarizeCharts(map, lights, 0);
  ASSERT_EQ(charts.size(), 2u);
  EXPECT_EQ(charts[0].chart, 2);
  EXPECT_EQ(charts[0].irradiance, 0);
  const ChartSummary& chart = charts[1];
  EXPECT_EQ(chart.chart, 4);
  EXPECT_EQ((std::array{chart.x0, chart.y0, chart.x1, chart.y1}), (std::array{2, 1, 7, 7}));
  EXPECT_EQ(chart.texels, 3);
  EXPECT_EQ(chart.invalid, 1);
  EXPECT_NEAR(chart.irradiance, 2, 1e-6);
  EXPECT_NEAR(chart.standard_error, std::sqrt(0.02), 1e-6);
}

}  // namespace
}  // namespace bakewell
