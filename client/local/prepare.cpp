#include <ctime>

#include <chrono>

#include "client/local/level_bake.h"
#include "core/scene/canonical.h"
#include "server/chart/generate.h"
#include "server/chart/keep.h"

namespace bakewell {

double PhaseClock::CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double PhaseClock::WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void PhaseClock::Begin(std::string phase) {
  phases_.push_back({std::move(phase)});
  wall_ = WallSeconds();
  cpu_ = CpuSeconds();
}

void PhaseClock::End() {
  phases_.back().wall_seconds = WallSeconds() - wall_;
  phases_.back().cpu_seconds = CpuSeconds() - cpu_;
}

namespace {

constexpr float kDefaultTexelsPerMetre = 8;

bool HasOwnCharts(const Scene& scene) {
  for (const Object& object : scene.objects) {
    if (object.lightmapped && object.uv1.empty()) return false;
  }
  return !scene.objects.empty();
}

// Page size that makes the scene's own UVs come out at a density [texels/m].
int PageSideForDensity(const Scene& scene, float texels_per_metre) {
  double world_area = 0, uv_area = 0;
  for (const Object& object : scene.objects) {
    if (!object.lightmapped) continue;
    for (size_t i = 0; i + 2 < object.index.size(); i += 3) {
      const uint32_t a = object.index[i], b = object.index[i + 1], c = object.index[i + 2];
      world_area += Length(
          Cross(ToDouble(object.position[b] - object.position[a]), ToDouble(object.position[c] - object.position[a])));
      uv_area += std::fabs(static_cast<double>(Cross(object.uv1[b] - object.uv1[a], object.uv1[c] - object.uv1[a])));
    }
  }
  const double side = uv_area > 0 ? static_cast<double>(texels_per_metre) * std::sqrt(world_area / uv_area) : 4;
  return static_cast<int>(std::clamp(std::ceil(side), 4.0, 16384.0));
}

PageSize KeptPage(const Scene& scene, const BakeSettings& settings) {
  if (settings.resolution > 0) return {settings.resolution, settings.resolution};
  if (settings.texels_per_metre <= 0 && scene.lightmap_page)
    return {scene.lightmap_page->width, scene.lightmap_page->height};
  const float density = settings.texels_per_metre > 0 ? settings.texels_per_metre : kDefaultTexelsPerMetre;
  const int side = PageSideForDensity(scene, density);
  return {side, side};
}

absl::StatusOr<AtlasLayout> MakeCharts(const Scene& scene, const BakeSettings& settings) {
  const bool keep = settings.uv == UvMode::kKeep || (settings.uv == UvMode::kAuto && HasOwnCharts(scene));
  if (keep) return KeepCharts(scene, KeptPage(scene, settings));
  GenerateOptions options;
  options.resolution = settings.resolution;
  options.texels_per_metre = settings.texels_per_metre;
  if (options.resolution == 0 && options.texels_per_metre <= 0) options.texels_per_metre = kDefaultTexelsPerMetre;
  return GenerateCharts(scene, options);
}

void WarnAboutTexels(const TexelMap& texels, std::vector<std::string>& warnings) {
  if (texels.overlapping_texels > 0) {
    warnings.push_back(
        std::to_string(texels.overlapping_texels) +
        " texels are covered by more than one chart: their TEXCOORD_1 overlaps or lies closer than a texel; "
        "use --uv generate");
  }
}

}  // namespace

absl::StatusOr<PreparedLevel> PrepareLevel(LoadedLevel level, const BakeSettings& settings, PhaseClock& clock,
                                           Progress& progress) {
  PreparedLevel prepared;
  prepared.level = std::make_unique<LoadedLevel>(std::move(level));
  prepared.warnings = prepared.level->warnings;
  Scene& scene = prepared.level->scene;
  if (settings.environment) scene.environment = *settings.environment;
  clock.Begin("chart");
  progress.Report("chart", 0, 1);
  BAKEWELL_ASSIGN_OR_RETURN(prepared.layout, MakeCharts(scene, settings));
  progress.Report("chart", 1, 1);
  clock.End();
  clock.Begin("texels");
  progress.Report("texels", 0, 1);
  BAKEWELL_ASSIGN_OR_RETURN(prepared.world, World::Build(scene, settings.backfaces, settings.albedo_limit));
  prepared.lights = std::make_unique<LightSet>(*prepared.world, scene.environment);
  prepared.texels = RasterizeTexels(*prepared.world, prepared.layout, settings.footprint);
  WarnAboutTexels(prepared.texels, prepared.warnings);
  progress.Report("texels", 1, 1);
  clock.End();
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  if (prepared.texels.texels.empty()) {
    return absl::InvalidArgumentError(
        "no lightmapped surface covers a texel: every mesh has extras.lightmapped false or no area");
  }
  return prepared;
}

}  // namespace bakewell
