#include <tbb/global_control.h>

#include <cmath>
#include <thread>

#include "client/local/bake.h"
#include "client/local/level_bake.h"
#include "core/image/exr.h"
#include "core/image/png.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "worker/gather/reference.h"

namespace bakewell {
namespace {

absl::StatusOr<PreparedLevel> LoadAndPrepare(const std::filesystem::path& path, const BakeSettings& settings,
                                             PhaseClock& clock, Progress& progress) {
  clock.Begin("load");
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel level, LoadLevel(path));
  clock.End();
  auto prepared = PrepareLevel(std::move(level), settings, clock, progress);
  if (prepared.ok() || absl::IsCancelled(prepared.status())) return prepared;
  return absl::Status(prepared.status().code(), path.string() + ": " + std::string(prepared.status().message()));
}

// Writes one page's images into the staging folder and lists them.
class PageWriter {
 public:
  PageWriter(const std::filesystem::path& folder, std::vector<ManifestFile>& files) : folder_(folder), files_(files) {}

  absl::Status Exr(const std::string& name, const char* kind, const Image& image) {
    BAKEWELL_RETURN_IF_ERROR(WriteExr(folder_ / name, image));
    return List(name, kind);
  }
  absl::Status Preview(const std::string& name, const Image& irradiance) {
    BAKEWELL_RETURN_IF_ERROR(WritePng(folder_ / name, irradiance.width, irradiance.height, TonemapPreview(irradiance)));
    return List(name, "preview");
  }
  absl::Status List(const std::string& name, const char* kind) {
    BAKEWELL_ASSIGN_OR_RETURN(ManifestFile file, DescribeFile(folder_ / name, kind));
    files_.push_back(std::move(file));
    return absl::OkStatus();
  }

 private:
  const std::filesystem::path& folder_;
  std::vector<ManifestFile>& files_;
};

// The reference's images of one page: mean, two halves, standard error.
struct ReferencePages {
  Image mean, a, b, standard_error;
};

ReferencePages PutReference(const TexelMap& map, std::span<const ReferenceTexel> texels, int page) {
  const PageSize size = map.pages[page];
  const std::vector<std::string> rgba{"R", "G", "B", "A"};
  ReferencePages pages{Image(size.width, size.height, rgba), Image(size.width, size.height, rgba),
                       Image(size.width, size.height, rgba), Image(size.width, size.height, {"Y"})};
  for (size_t i = 0; i < texels.size(); ++i) {
    const Texel& texel = map.texels[i];
    if (texel.page != page) continue;
    for (int c = 0; c < 3; ++c) {
      pages.mean.At(c, texel.x, texel.y) = texels[i].irradiance[c];
      pages.a.At(c, texel.x, texel.y) = texels[i].half_a[c];
      pages.b.At(c, texel.x, texel.y) = texels[i].half_b[c];
    }
    const float coverage = texels[i].valid ? std::min(1.0f, texel.coverage) : 0.0f;
    pages.mean.At(3, texel.x, texel.y) = pages.a.At(3, texel.x, texel.y) = pages.b.At(3, texel.x, texel.y) = coverage;
    pages.standard_error.At(0, texel.x, texel.y) = texels[i].standard_error;
  }
  return pages;
}

double ReferenceError(std::span<const ReferenceTexel> texels) {
  double variance = 0, sum = 0;
  for (const ReferenceTexel& t : texels) {
    variance += static_cast<double>(t.standard_error) * static_cast<double>(t.standard_error);
    sum += static_cast<double>(Luminance(t.irradiance));
  }
  return sum > 0 ? std::sqrt(variance * static_cast<double>(texels.size())) / sum : 0;
}

}  // namespace

absl::StatusOr<BakeSummary> BakeReference(const ReferenceRequest& request, Progress& progress) {
  const double wall = PhaseClock::WallSeconds(), cpu = PhaseClock::CpuSeconds();
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(ThreadCount(request.threads)));
  PhaseClock clock;
  BAKEWELL_ASSIGN_OR_RETURN(const PreparedLevel prepared,
                            LoadAndPrepare(request.scene_path, request.settings, clock, progress));
  Manifest manifest;
  manifest.scene_file = request.scene_path.filename().string();
  manifest.scene_digest = SceneDigest(prepared.level->scene);
  manifest.settings_json = SettingsJson(request.settings);
  manifest.warnings = prepared.warnings;
  clock.Begin("reference");
  const std::vector<ReferenceTexel> texels =
      TraceReference(*prepared.world, *prepared.lights, prepared.layout, prepared.texels, request.spp,
                     request.settings.seed, progress, manifest.rays);
  clock.End();
  if (progress.Cancelled()) return absl::CancelledError("cancelled");
  manifest.estimated_error = ReferenceError(texels);
  manifest.counters["reference/spp"] = request.spp;
  BAKEWELL_ASSIGN_OR_RETURN(OutputDir out, OutputDir::Create(request.output_dir));
  PageWriter writer(out.Staging(), manifest.files);
  for (int page = 0; page < static_cast<int>(prepared.texels.pages.size()); ++page) {
    const ReferencePages images = PutReference(prepared.texels, texels, page);
    const std::string name = "reference-" + std::to_string(page);
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".irradiance.exr", "reference", images.mean));
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".half-a.exr", "reference-half", images.a));
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".half-b.exr", "reference-half", images.b));
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".stderr.exr", "standard-error", images.standard_error));
    BAKEWELL_RETURN_IF_ERROR(writer.Preview(name + ".png", images.mean));
  }
  BAKEWELL_ASSIGN_OR_RETURN(BakeSummary summary, Conclude(out, request.output_dir, manifest));
  summary.phases = clock.phases();
  summary.peak_memory_bytes = PhaseClock::PeakMemoryBytes();
  summary.wall_seconds = PhaseClock::WallSeconds() - wall;
  summary.cpu_seconds = PhaseClock::CpuSeconds() - cpu;
  return summary;
}

}  // namespace bakewell
