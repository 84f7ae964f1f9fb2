#pragma once

#include <span>
#include <string>

namespace bakewell {

// What a bake knows about one chart of a page.
struct ChartSummary {
  int chart = 0;       // AtlasLayout::charts
  int x0 = 0, y0 = 0;  // texels that it covers lie in [x0, x1) x [y0, y1)
  int x1 = 0, y1 = 0;
  int texels = 0, invalid = 0;  // covered; of these, inside other geometry
  double irradiance = 0;        // mean luminance over valid texels [W m^-2]
  double standard_error = 0;    // root mean square over valid texels, luminance [W m^-2]
};

// schema/charts.md: for each chart its error, relative to its own mean, and a bound that nine charts of ten stay below
// at preview and medium quality.
std::string ChartsJson(int page, std::span<const ChartSummary> charts);

// Standard errors in that bound: what filtering blurs and the cache spreads is in no variance.
inline constexpr double kErrorBound = 2;

}  // namespace bakewell
