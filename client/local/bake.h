#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/artifact/progress.h"
#include "core/artifact/settings.h"
#include "core/base/status.h"

namespace bakewell {

struct BakeRequest {
  std::filesystem::path scene_path;  // .glb or .gltf
  std::filesystem::path output_dir;  // made if it is not there; files of the same names are replaced
  BakeSettings settings;             // valid (ValidateSettings)
  int threads = 0;                   // 0: as many as the machine has
};

struct ReferenceRequest {
  std::filesystem::path scene_path;
  std::filesystem::path output_dir;
  BakeSettings settings;  // photons and samples are not looked at
  int threads = 0;
  int spp = 1024;  // paths a texel
};

// What a bake did; manifest.json has more.
struct BakeSummary {
  std::filesystem::path output_dir;
  std::vector<std::filesystem::path> files;  // sorted; in output_dir
  std::vector<std::string> warnings;         // what of the scene was ignored or repaired
  double estimated_error = 0;                // relative standard error, root mean square over valid texels
  double wall_seconds = 0, cpu_seconds = 0;
  int64_t rays = 0;
};

// Bakes one scene in this process. `progress` hears from any thread and is asked whether to stop.
// kInvalidArgument, kNotFound: the scene or the output folder is at fault; kCancelled: as asked; kUnavailable,
// kResourceExhausted: the disk. Unless it is OK, output_dir is as it was before.
absl::StatusOr<BakeSummary> Bake(const BakeRequest& request, Progress& progress);

// The unbiased path tracer over the same texels, with its standard error per texel. Errors as Bake().
absl::StatusOr<BakeSummary> BakeReference(const ReferenceRequest& request, Progress& progress);

}  // namespace bakewell
