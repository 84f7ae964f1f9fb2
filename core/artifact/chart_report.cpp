#include "core/artifact/chart_report.h"

#include <nlohmann/json.hpp>

namespace bakewell {

std::string ChartsJson(int page, std::span<const ChartSummary> charts) {
  using Json = nlohmann::ordered_json;
  // A chart a line: thousands of them are still to be read and compared.
  std::string text = "{\n\"format\": 1,\n\"page\": " + std::to_string(page) + ",\n\"charts\": [";
  const char* separator = "\n";
  for (const ChartSummary& chart : charts) {
    Json json = {{"chart", chart.chart},
                 {"x0", chart.x0},
                 {"y0", chart.y0},
                 {"x1", chart.x1},
                 {"y1", chart.y1},
                 {"texels", chart.texels},
                 {"invalid", chart.invalid},
                 {"irradiance", chart.irradiance},
                 {"estimated_error", nullptr},
                 {"error_bound", nullptr}};
    if (chart.irradiance > 0) {
      json["estimated_error"] = chart.standard_error / chart.irradiance;
      json["error_bound"] = kErrorBound * chart.standard_error / chart.irradiance;
    }
    text += separator + json.dump();
    separator = ",\n";
  }
  return text + "\n]\n}\n";
}

}  // namespace bakewell
