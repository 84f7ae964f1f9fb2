#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/job/submission.h"
#include "client/rpc/farm_client.h"
#include "core/artifact/manifest.h"
#include "core/artifact/output_dir.h"
#include "core/artifact/phase_time.h"

namespace bakewell {

// What a bake did and took; manifest.json has more of the former.
struct BakeSummary {
  std::filesystem::path output_dir;
  std::vector<std::filesystem::path> files;  // sorted; in output_dir
  std::vector<std::string> warnings;         // what of the scene was ignored or repaired
  double estimated_error = 0;                // relative standard error, root mean square over valid texels
  int64_t rays = 0;
  double wall_seconds = 0, cpu_seconds = 0;
  std::vector<PhaseTime> phases;  // in the order they ran
  int64_t peak_memory_bytes = 0;  // resident, of the process that baked; 0: others did
};

// OK for a job that is done; else why it ended, with the code that its task gave and the scene's name before the text.
absl::Status StatusOfEnded(const v1::Job& job, const std::filesystem::path& scene_path);

// What a job's tasks took, by the names of Progress::Report, in the order of a bake.
std::vector<PhaseTime> PhasesOf(const v1::Job& job);

// Fetches the files of a job that is done into out.Staging(), writes scene.glb beside them, and says what
// manifest.json is to say. kDataLoss: artifacts that do not belong together; else as
// FarmClient::Fetch and WriteLevel.
absl::StatusOr<Manifest> FetchResult(FarmClient& client, const v1::Job& job, const Submission& submission,
                                     const OutputDir& out);

// Writes the manifest and moves the staged files into place; the summary without what the run took.
absl::StatusOr<BakeSummary> Conclude(OutputDir& out, const std::filesystem::path& folder, const Manifest& manifest);

}  // namespace bakewell
