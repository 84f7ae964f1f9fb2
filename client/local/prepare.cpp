#include "client/local/level_bake.h"
#include "client/local/signal_density.h"
#include "core/scene/canonical.h"
#include "server/chart/choose.h"

namespace bakewell {

namespace {

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
  BAKEWELL_ASSIGN_OR_RETURN(prepared.layout, ChooseCharts(scene, settings));
  progress.Report("chart", 1, 1);
  clock.End();
  clock.Begin("texels");
  progress.Report("texels", 0, 1);
  BAKEWELL_ASSIGN_OR_RETURN(prepared.world,
                            World::Build(scene, settings.backfaces, settings.albedo_limit, settings.no_skip));
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
  if (settings.density == DensityMode::kSignal) {
    BAKEWELL_RETURN_IF_ERROR(FollowSignal(settings, clock, progress, prepared));
  }
  return prepared;
}

}  // namespace bakewell
