#include "client/local/signal_density.h"

#include <algorithm>
#include <cmath>

#include "client/local/bake_texels.h"
#include "server/chart/choose.h"

namespace bakewell {
namespace {

constexpr double kBudgetTolerance = 0.01;
constexpr int kMaxLayouts = 6;
// Texels share photons, so their variances overstate how much they differ from one another.
constexpr double kNoiseShare = 0.5;
// What happens at the borders of charts is not in the second differences: the factors stay near 1.
constexpr chart::NeedLimits kLimits{0.6, 1.7};
constexpr int kLeastSteps = 8;  // second differences that say something about a chart

// The preview's phases as one, and the outer progress' wish to stop.
class PreviewProgress : public Progress {
 public:
  explicit PreviewProgress(Progress& outer) : outer_(outer) {}
  void Report(std::string_view phase, int64_t done, int64_t total) override {
    if (phase == "gather") outer_.Report("preview", done, total);
    if (outer_.Cancelled()) Cancel();
  }

 private:
  Progress& outer_;
};

BakeSettings PreviewSettings(BakeSettings settings) {
  settings.quality = Quality::kPreview;
  settings.target_error = 0;
  settings.min_samples = settings.max_samples = 0;
  settings.photons = 0;
  return settings;
}

// Sums over one chart.
struct ChartSums {
  double area = 0;    // [m^2]
  double square = 0;  // of second differences, less their noise [(W m^-2)^2]
  double side = 0;    // of the texels concerned [m]
  int64_t steps = 0;
};

double LuminanceVariance(const TexelLight& light) {
  const auto square = [](double x) { return x * x; };
  return square(0.2126) * double{light.variance.x} + square(0.7152) * double{light.variance.y} +
         square(0.0722) * double{light.variance.z};
}

class SignalSums {
 public:
  SignalSums(size_t chart_count, const TexelMap& map, std::span<const TexelLight> lights)
      : map_(map), lights_(lights), sums_(chart_count) {}

  std::vector<ChartSums> Run() && {
    for (size_t i = 0; i < map_.texels.size(); ++i) {
      const Texel& texel = map_.texels[i];
      if (texel.chart == kNoChart) continue;
      sums_[texel.chart].area += double{texel.area};
      AddStep(texel, i, 1, 0);
      AddStep(texel, i, 0, 1);
    }
    return std::move(sums_);
  }

 private:
  // The lit texel of the same chart there, or -1.
  int32_t Neighbour(const Texel& texel, int dx, int dy) const {
    const PageSize page = map_.pages[texel.page];
    const int x = texel.x + dx, y = texel.y + dy;
    if (x < 0 || y < 0 || x >= page.width || y >= page.height) return -1;
    const int32_t i = map_.texel_at[texel.page][static_cast<size_t>(y) * page.width + x];
    return i >= 0 && map_.texels[i].chart == texel.chart && lights_[i].valid ? i : -1;
  }

  void AddStep(const Texel& texel, size_t i, int dx, int dy) {
    const int32_t a = Neighbour(texel, -dx, -dy), b = Neighbour(texel, dx, dy);
    if (a < 0 || b < 0 || !lights_[i].valid) return;
    const auto luminance = [&](size_t k) { return double{Luminance(lights_[k].irradiance)}; };
    const double difference = luminance(i) - (luminance(a) + luminance(b)) / 2;
    const double noise =
        LuminanceVariance(lights_[i]) + (LuminanceVariance(lights_[a]) + LuminanceVariance(lights_[b])) / 4;
    ChartSums& sums = sums_[texel.chart];
    sums.square += difference * difference - kNoiseShare * noise;
    sums.side += std::sqrt(double{texel.area} / double{texel.coverage});
    ++sums.steps;
  }

  const TexelMap& map_;
  std::span<const TexelLight> lights_;
  std::vector<ChartSums> sums_;
};

// The layout with as many texels as the prepared one, or as near as kMaxLayouts densities come: whole texels make
// steps.
absl::StatusOr<AtlasLayout> SameBudget(const PreparedLevel& prepared, BakeSettings settings,
                                       std::span<const float> factors) {
  const Scene& scene = prepared.level->scene;
  const bool fixed_pages = settings.texels_per_metre <= 0 && settings.resolution > 0;
  if (fixed_pages) return ChooseCharts(scene, settings, factors);
  const double budget = static_cast<double>(prepared.texels.texels.size());
  double density = double{prepared.layout.texels_per_metre}, low = 0, high = INFINITY, least = INFINITY;
  AtlasLayout best;
  for (int i = 0; i < kMaxLayouts && least > kBudgetTolerance; ++i) {
    settings.texels_per_metre = static_cast<float>(density);
    BAKEWELL_ASSIGN_OR_RETURN(AtlasLayout layout, ChooseCharts(scene, settings, factors));
    const TexelMap texels = RasterizeTexels(*prepared.world, layout, settings.footprint);
    const double share = static_cast<double>(texels.texels.size()) / budget;
    (share < 1 ? low : high) = density;
    if (std::abs(share - 1) < least) {
      least = std::abs(share - 1);
      best = std::move(layout);
    }
    density = low > 0 && high < INFINITY ? std::sqrt(low * high) : density / std::sqrt(std::clamp(share, 0.25, 4.0));
  }
  return best;
}

}  // namespace

std::vector<chart::ChartNeed> MeasureNeeds(size_t chart_count, const TexelMap& texels,
                                           std::span<const TexelLight> lights) {
  const std::vector<ChartSums> sums = SignalSums(chart_count, texels, lights).Run();
  std::vector<chart::ChartNeed> needs(chart_count);
  double known_area = 0, sum = 0;
  for (size_t c = 0; c < chart_count; ++c) {
    needs[c].area = sums[c].area;
    if (sums[c].steps < kLeastSteps) continue;
    const double steps = static_cast<double>(sums[c].steps);
    needs[c].rms_gradient = std::sqrt(std::max(0.0, sums[c].square / steps)) / (sums[c].side / steps);
    known_area += needs[c].area;
    sum += needs[c].area * needs[c].rms_gradient;
  }
  for (size_t c = 0; c < chart_count; ++c)
    if (sums[c].steps < kLeastSteps && known_area > 0) needs[c].rms_gradient = sum / known_area;
  return needs;
}

absl::Status FollowSignal(const BakeSettings& settings, PhaseClock& clock, Progress& progress,
                          PreparedLevel& prepared) {
  if (KeepsCharts(prepared.level->scene, settings)) {
    prepared.warnings.push_back("--density signal changes nothing: the scene keeps its TEXCOORD_1 (--uv generate)");
    return absl::OkStatus();
  }
  clock.Begin("preview");
  PhaseClock own_clock;
  PreviewProgress own_progress(progress);
  BAKEWELL_ASSIGN_OR_RETURN(const BakedTexels preview,
                            BakeTexels(prepared, PreviewSettings(settings), own_clock, own_progress));
  const std::vector<float> factors =
      chart::DensityFactors(MeasureNeeds(prepared.layout.charts.size(), prepared.texels, preview.lights), kLimits);
  BAKEWELL_ASSIGN_OR_RETURN(prepared.layout, SameBudget(prepared, settings, factors));
  prepared.texels = RasterizeTexels(*prepared.world, prepared.layout, settings.footprint);
  clock.End();
  return absl::OkStatus();
}

}  // namespace bakewell
