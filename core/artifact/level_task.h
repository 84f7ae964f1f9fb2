#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/artifact/skip.h"
#include "core/artifact/task.h"
#include "core/base/status.h"

namespace bakewell::level_task {

// The tasks of a bake, as the planner of the coordinator and the executors of the workers agree on them. Inputs and
// outputs by name:
//   chart/layout    scene                          -> layout
//   texel/survey    scene layout                   -> survey
//   photon/emit     scene layout                   -> flux         range: photon batch begin of end
//   photon/density  scene layout flux0 flux1 ...   -> cache, totals
//   gather/tiles    scene layout cache             -> lights, preview-P (page P)   range: tiles [begin, end)
//   finish/page     scene layout lights0 ...       -> the files of page begin, tally
//   finish/report   survey totals tally0 ...       -> statistics.json (bake_report.h)
// The version of a kind is raised whenever its bytes change for equal inputs.
struct KindName {
  const char* kind;
  uint32_t code_version;
};
inline constexpr KindName kChart{"chart/layout", 2};
inline constexpr KindName kSurvey{"texel/survey", 17};
inline constexpr KindName kEmit{"photon/emit", 12};
inline constexpr KindName kDensity{"photon/density", 8};
inline constexpr KindName kGather{"gather/tiles", 38};
inline constexpr KindName kFinish{"finish/page", 22};
inline constexpr KindName kReport{"finish/report", 5};
inline constexpr KindName kAll[] = {kChart, kSurvey, kEmit, kDensity, kGather, kFinish, kReport};

// The files of page P are lightmap-P and each of these.
struct PageFile {
  const char *ending, *kind;  // kind: in the manifest
};
inline constexpr PageFile kPageFiles[] = {{".irradiance.exr", "irradiance"},
                                          {".sh.exr", "sh"},
                                          {".variance.exr", "variance"},
                                          {".png", "preview"},
                                          {".charts.json", "charts"}};

// The artifacts that are no files of the result: they say how to write scene.glb and the manifest.
inline constexpr char kLayoutArtifact[] = "atlas-layout.bin";
inline constexpr char kReportArtifact[] = "statistics.json";

// An output of any task whose name begins so is a SerializePreview() blob (page_preview.h) of the picture of that name:
// what a coordinator shows of a job that runs.
inline constexpr char kPreviewPrefix[] = "preview-";

// TaskSpec::settings of all of them. `settings_json` is proto/settings.h SettingsJson() of the settings that the kind
// looks at, the others being the defaults.
struct Settings {
  std::string settings_json;
  uint32_t begin = 0, end = 0;
};
std::string Serialize(const Settings& settings);
absl::StatusOr<Settings> ParseSettings(std::string_view bytes);

// What the planner has to know about the texels of a layout.
struct Survey {
  uint64_t texels = 0, photons = 0;
  bool has_cache = false;                  // the survey's pilot flew as many: its task makes what "photon/density" does
  uint64_t overlapping_texels = 0;         // covered by more than one chart
  SkipCount opaque_alpha;                  // triangles
  std::vector<uint32_t> texels_of_tile;    // tile_count
  std::vector<uint32_t> tile_end_of_page;  // one per page: its tiles end here, and begin where the page before ended
};
std::string Serialize(const Survey& survey);
absl::StatusOr<Survey> ParseSurvey(std::string_view bytes);

// What the photons' tasks counted.
struct PhotonCounts {
  int64_t photons = 0, photon_rays = 0, density_rays = 0, cells = 0;
  SkipCount unfaced_backs;  // sides of cells, rays
};
std::string Serialize(const PhotonCounts& counts);
absl::StatusOr<PhotonCounts> ParsePhotonCounts(std::string_view bytes);

}  // namespace bakewell::level_task
