#include <absl/strings/numbers.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>

#include "client/local/bake_texels.h"
#include "worker/finish/page.h"

// bench_density LEVEL TEXELS_PER_METRE: the error of a lightmap with uniform and with signal-driven density, measured
// on the surface: at points spread evenly over the lightmapped triangles, the lightmap filtered bilinearly against a
// bake of kTruthDensity times the density. All are baked with the same quality.
namespace bakewell {
namespace {

constexpr int kPoints = 200000;
constexpr float kTruthDensity = 3;

class NoProgress : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

// A baked level and its pages.
struct Lightmap {
  PreparedLevel prepared;
  std::vector<Image> irradiance;
  double cpu_s = 0;

  int64_t texels() const { return static_cast<int64_t>(prepared.texels.texels.size()); }
  int64_t page_texels() const {
    int64_t sum = 0;
    for (const PageSize& page : prepared.layout.pages) sum += int64_t{page.width} * page.height;
    return sum;
  }
};

absl::StatusOr<Lightmap> BakeLightmap(const std::string& path, const BakeSettings& settings) {
  NoProgress progress;
  PhaseClock clock;
  const double begin = PhaseClock::CpuSeconds();
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel level, LoadLevel(path));
  Lightmap lightmap;
  BAKEWELL_ASSIGN_OR_RETURN(lightmap.prepared, PrepareLevel(std::move(level), settings, clock, progress));
  BAKEWELL_ASSIGN_OR_RETURN(const BakedTexels baked, BakeTexels(lightmap.prepared, settings, clock, progress));
  for (size_t page = 0; page < lightmap.prepared.texels.pages.size(); ++page)
    lightmap.irradiance.push_back(
        FinishPage(lightmap.prepared.texels, baked.lights, static_cast<int>(page)).irradiance);
  lightmap.cpu_s = PhaseClock::CpuSeconds() - begin;
  return lightmap;
}

struct Point {
  size_t object, triangle;
  double b1, b2;
};

std::vector<Point> SpreadPoints(const Scene& scene, const AtlasLayout& layout) {
  std::vector<double> sum;
  std::vector<Point> triangles;
  double area = 0;
  for (size_t o = 0; o < scene.objects.size(); ++o)
    for (size_t t = 0; t < layout.objects[o].chart_of_triangle.size(); ++t) {
      if (layout.objects[o].chart_of_triangle[t] == kNoChart) continue;
      const Object& object = scene.objects[o];
      const auto p = [&](size_t k) { return ToDouble(object.position[object.index[3 * t + k]]); };
      area += Length(Cross(p(1) - p(0), p(2) - p(0)));
      sum.push_back(area);
      triangles.push_back({o, t, 0, 0});
    }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Point> points;
  for (int i = 0; i < kPoints; ++i) {
    const double target = (i + unit(random)) / kPoints * area;
    const size_t k = static_cast<size_t>(std::lower_bound(sum.begin(), sum.end(), target) - sum.begin());
    Point point = triangles[std::min(k, triangles.size() - 1)];
    point.b1 = unit(random), point.b2 = unit(random);
    if (point.b1 + point.b2 > 1) point.b1 = 1 - point.b1, point.b2 = 1 - point.b2;
    points.push_back(point);
  }
  return points;
}

// Luminance at a point, filtered bilinearly.
double Look(const Lightmap& lightmap, const Point& point) {
  const AtlasLayout& layout = lightmap.prepared.layout;
  const ObjectCharts& charts = layout.objects[point.object];
  const auto uv = [&](size_t k) { return charts.uv[charts.index[3 * point.triangle + k]]; };
  const auto mix = [&](double a, double b, double c) { return a + (b - a) * point.b1 + (c - a) * point.b2; };
  const double x = mix(uv(0).x, uv(1).x, uv(2).x) - 0.5, y = mix(uv(0).y, uv(1).y, uv(2).y) - 0.5;
  const Image& image = lightmap.irradiance[layout.charts[charts.chart_of_triangle[point.triangle]].page];
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const auto at = [&](int px, int py) {
    px = std::clamp(px, 0, image.width - 1), py = std::clamp(py, 0, image.height - 1);
    return 0.2126 * double{image.At(0, px, py)} + 0.7152 * double{image.At(1, px, py)} +
           0.0722 * double{image.At(2, px, py)};
  };
  const double fx = x - x0, fy = y - y0;
  return (at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx) * (1 - fy) +
         (at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx) * fy;
}

double RelativeRms(const Lightmap& lightmap, const Lightmap& truth, std::span<const Point> points) {
  double square = 0, mean = 0;
  for (const Point& point : points) {
    const double reference = Look(truth, point), difference = Look(lightmap, point) - reference;
    square += difference * difference;
    mean += reference;
  }
  const double count = static_cast<double>(points.size());
  return std::sqrt(square / count) / (mean / count);
}

absl::Status Run(const std::string& path, float density) {
  BakeSettings settings;
  settings.uv = UvMode::kGenerate;
  settings.texels_per_metre = density;
  BAKEWELL_ASSIGN_OR_RETURN(const Lightmap uniform, BakeLightmap(path, settings));
  settings.density = DensityMode::kSignal;
  BAKEWELL_ASSIGN_OR_RETURN(const Lightmap signal, BakeLightmap(path, settings));
  settings.density = DensityMode::kUniform;
  settings.texels_per_metre = density * kTruthDensity;
  BAKEWELL_ASSIGN_OR_RETURN(const Lightmap truth, BakeLightmap(path, settings));
  const std::vector<Point> points = SpreadPoints(uniform.prepared.level->scene, uniform.prepared.layout);
  const double before = RelativeRms(uniform, truth, points), after = RelativeRms(signal, truth, points);
  std::cout << absl::StrFormat("| %s | %g | %d / %d | %d / %d | %.2f %% / %.2f %% | %.2f | %.1f / %.1f |\n",
                               std::filesystem::path(path).stem().string(), density, uniform.texels(), signal.texels(),
                               uniform.page_texels(), signal.page_texels(), 100 * before, 100 * after, after / before,
                               uniform.cpu_s, signal.cpu_s);
  return absl::OkStatus();
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  float density = 0;
  if (argc != 3 || !absl::SimpleAtof(argv[2], &density)) {
    std::cerr << "usage: bench_density LEVEL TEXELS_PER_METRE\n";
    return 2;
  }
  const absl::Status status = bakewell::Run(argv[1], density);
  if (!status.ok()) std::cerr << status << "\n";
  return status.ok() ? 0 : 1;
}
