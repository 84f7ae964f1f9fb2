#include "server/chart/choose.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/artifact/level_task.h"
#include "core/atlas/serialize.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "server/chart/generate.h"
#include "server/chart/keep.h"

namespace bakewell {

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
    if (!object.lightmapped || object.uv1.size() != object.position.size()) continue;  // KeepCharts refuses it
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

}  // namespace

bool KeepsCharts(const Scene& scene, const BakeSettings& settings) {
  return settings.uv == UvMode::kKeep || (settings.uv == UvMode::kAuto && HasOwnCharts(scene));
}

absl::StatusOr<AtlasLayout> ChooseCharts(const Scene& scene, const BakeSettings& settings,
                                         std::span<const float> chart_density) {
  if (KeepsCharts(scene, settings)) return KeepCharts(scene, KeptPage(scene, settings));
  GenerateOptions options;
  options.resolution = settings.resolution;
  options.texels_per_metre = settings.texels_per_metre;
  if (options.resolution == 0 && options.texels_per_metre <= 0) options.texels_per_metre = kDefaultTexelsPerMetre;
  options.chart_density.assign(chart_density.begin(), chart_density.end());
  return GenerateCharts(scene, options);
}

absl::StatusOr<std::string> RunChartTask(std::string_view task_settings, std::string_view scene_bytes) {
  BAKEWELL_ASSIGN_OR_RETURN(const level_task::Settings task, level_task::ParseSettings(task_settings));
  const LatLongReader no_pictures = [](const std::string&) -> absl::StatusOr<Environment> {
    return absl::InvalidArgumentError("charting looks at no picture");
  };
  BAKEWELL_ASSIGN_OR_RETURN(const BakeSettings settings, SettingsFromJson(task.settings_json, no_pictures));
  BAKEWELL_ASSIGN_OR_RETURN(const Scene scene, ParseScene(std::as_bytes(std::span(scene_bytes))));
  BAKEWELL_ASSIGN_OR_RETURN(const AtlasLayout layout, ChooseCharts(scene, settings));
  return SerializeLayout(layout);
}

}  // namespace bakewell
