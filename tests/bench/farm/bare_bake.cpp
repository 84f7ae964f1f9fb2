// The bare kernels and the files of the first page, by direct calls: what the embedded bake's CPU time is measured
// against.
//   bare_bake SCENE FOLDER preview|medium|high RESOLUTION
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/bake_scene.h"
#include "worker/finish/bands.h"
#include "worker/level/page_files.h"

namespace bakewell {
namespace {

absl::Status Run(char** words) {
  BakeSettings settings;
  const std::string quality = words[3];
  settings.quality = quality == "high" ? Quality::kHigh : quality == "medium" ? Quality::kMedium : Quality::kPreview;
  settings.resolution = std::atoi(words[4]);
  PhaseClock clock;
  SilentProgress progress;
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel level, LoadLevel(words[1]));
  BAKEWELL_ASSIGN_OR_RETURN(const PreparedLevel prepared, PrepareLevel(std::move(level), settings, clock, progress));
  BAKEWELL_ASSIGN_OR_RETURN(BakedTexels baked, BakeTexels(prepared, settings, clock, progress));
  const GatherOptions asked = BudgetOf(settings, std::ssize(prepared.texels.texels)).gather;
  std::filesystem::create_directories(words[2]);
  for (int page = 0; page < static_cast<int>(prepared.texels.pages.size()); ++page) {
    SkipCount bands;
    DropBands(prepared.texels, page, asked.target_error, baked.lights, bands);
    BAKEWELL_ASSIGN_OR_RETURN(const MadeOutputs files, PageFiles(prepared.texels, baked.lights, page));
    for (const MadeOutput& file : files) {
      std::ofstream(std::filesystem::path(words[2]) / file.name, std::ios::binary) << file.bytes;
    }
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "bare_bake SCENE FOLDER preview|medium|high RESOLUTION\n");
    return 2;
  }
  const absl::Status status = bakewell::Run(argv);
  if (!status.ok()) std::fprintf(stderr, "%s\n", status.ToString().c_str());
  return status.ok() ? 0 : 1;
}
