#include "worker/finish/charts.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace bakewell {

std::vector<ChartSummary> SummarizeCharts(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  std::map<int, ChartSummary> charts;  // sums, until they are divided
  for (size_t i = 0; i < map.texels.size(); ++i) {
    const Texel& texel = map.texels[i];
    if (texel.page != page) continue;
    ChartSummary fresh{texel.chart, texel.x, texel.y, texel.x, texel.y};
    ChartSummary& chart = charts.try_emplace(texel.chart, fresh).first->second;
    chart.x0 = std::min<int>(chart.x0, texel.x);
    chart.y0 = std::min<int>(chart.y0, texel.y);
    chart.x1 = std::max<int>(chart.x1, texel.x + 1);
    chart.y1 = std::max<int>(chart.y1, texel.y + 1);
    ++chart.texels;
    chart.invalid += lights[i].valid ? 0 : 1;
    if (!lights[i].valid) continue;
    chart.irradiance += static_cast<double>(Luminance(lights[i].irradiance));
    chart.standard_error += static_cast<double>(LuminanceVariance(lights[i].variance));
  }
  std::vector<ChartSummary> result;
  for (auto& [number, chart] : charts) {
    const int valid = std::max(1, chart.texels - chart.invalid);
    chart.irradiance /= valid;
    chart.standard_error = std::sqrt(chart.standard_error / valid);
    result.push_back(chart);
  }
  return result;
}

}  // namespace bakewell
