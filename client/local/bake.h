#pragma once

#include <cstdint>
#include <filesystem>

#include "client/job/result.h"
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

// As many as asked for, 0: as the machine has.
int ThreadCount(int threads);

// Bakes one scene in this process, as a job of a farm of its own: the same planner, tasks and bytes. `progress` hears
// from any thread and is asked whether to stop. kInvalidArgument, kNotFound: the scene or the output folder is at
// fault; kCancelled: as asked; kUnavailable, kResourceExhausted: the disk. Unless it is OK, output_dir is as it was
// before.
absl::StatusOr<BakeSummary> Bake(const BakeRequest& request, Progress& progress);

// The unbiased path tracer over the same texels, with its standard error per texel. Errors as Bake().
absl::StatusOr<BakeSummary> BakeReference(const ReferenceRequest& request, Progress& progress);

}  // namespace bakewell
