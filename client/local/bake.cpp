#include "client/local/bake.h"

#include <tbb/global_control.h>

#include <cmath>
#include <thread>

#include "client/local/level_bake.h"
#include "core/artifact/output_dir.h"
#include "core/image/exr.h"
#include "core/image/png.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"
#include "worker/finish/page.h"
#include "worker/gather/reference.h"

namespace bakewell {
namespace {

constexpr double kMostBadSamples = 1e-6;  // share of NaN or infinite samples above which a bake fails

tbb::global_control Threads(int threads) {
  const unsigned int count =
      threads > 0 ? static_cast<unsigned int>(threads) : std::max(1U, std::thread::hardware_concurrency());
  return {tbb::global_control::max_allowed_parallelism, count};
}

absl::StatusOr<PreparedLevel> LoadAndPrepare(const std::filesystem::path& path, const BakeSettings& settings,
                                             PhaseClock& clock, Progress& progress) {
  clock.Begin("load");
  BAKEWELL_ASSIGN_OR_RETURN(LoadedLevel level, LoadLevel(path));
  clock.End();
  auto prepared = PrepareLevel(std::move(level), settings, clock, progress);
  if (prepared.ok() || absl::IsCancelled(prepared.status())) return prepared;
  return absl::Status(prepared.status().code(), path.string() + ": " + std::string(prepared.status().message()));
}

double EstimatedError(std::span<const TexelLight> lights) {
  double variance = 0, sum = 0, count = 0;
  for (const TexelLight& light : lights) {
    if (!light.valid) continue;
    const double spread = 0.2126 * std::sqrt(static_cast<double>(light.variance.x)) +
                          0.7152 * std::sqrt(static_cast<double>(light.variance.y)) +
                          0.0722 * std::sqrt(static_cast<double>(light.variance.z));
    variance += spread * spread;
    sum += static_cast<double>(Luminance(light.irradiance));
    count += 1;
  }
  return sum > 0 ? std::sqrt(variance / count) / (sum / count) : 0;
}

std::string PageName(int page) { return "lightmap-" + std::to_string(page); }

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

absl::Status WritePages(const PreparedLevel& prepared, const BakedTexels& baked, const std::filesystem::path& folder,
                        std::vector<ManifestFile>& files, Progress& progress) {
  PageWriter writer(folder, files);
  const int pages = static_cast<int>(prepared.texels.pages.size());
  for (int page = 0; page < pages; ++page) {
    const PageImages images = FinishPage(prepared.texels, baked.lights, page);
    const std::string name = PageName(page);
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".irradiance.exr", "irradiance", images.irradiance));
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".sh.exr", "sh", images.sh));
    BAKEWELL_RETURN_IF_ERROR(writer.Exr(name + ".variance.exr", "variance", images.variance));
    BAKEWELL_RETURN_IF_ERROR(writer.Preview(name + ".png", images.irradiance));
    progress.Report("finish", page + 1, pages);
    if (progress.Cancelled()) return absl::CancelledError("cancelled");
  }
  return absl::OkStatus();
}

absl::Status WriteScene(const BakeRequest& request, const PreparedLevel& prepared, const std::filesystem::path& folder,
                        std::vector<ManifestFile>& files) {
  std::vector<LightmapFiles> pages;
  for (size_t page = 0; page < prepared.texels.pages.size(); ++page) {
    const std::string name = PageName(static_cast<int>(page));
    pages.push_back({name + ".irradiance.exr", name + ".sh.exr", name + ".variance.exr"});
  }

  BAKEWELL_RETURN_IF_ERROR(
      WriteLevel(request.scene_path, *prepared.level, prepared.layout, pages, folder / "scene.glb"));
  return PageWriter(folder, files).List("scene.glb", "scene");
}

Manifest MakeManifest(const std::filesystem::path& scene_path, const BakeSettings& settings,
                      const PreparedLevel& prepared) {
  Manifest manifest;
  manifest.scene_file = scene_path.filename().string();
  manifest.scene_digest = SceneDigest(prepared.level->scene);
  manifest.settings_json = SettingsJson(settings);
  manifest.warnings = prepared.warnings;
  return manifest;
}

void CountTexels(std::span<const TexelLight> lights, std::map<std::string, int64_t>& counters) {
  for (const TexelLight& light : lights) {
    counters["texels/covered"] += 1;
    counters["texels/invalid"] += light.valid ? 0 : 1;
    counters["gather/direct_samples"] += light.direct_samples;
    counters["gather/indirect_samples"] += light.indirect_samples;
  }
}

void AddBakeFigures(const BakedTexels& baked, Manifest& manifest) {
  auto& counters = manifest.counters;
  CountTexels(baked.lights, counters);
  counters["photons/rays"] = baked.photon_rays;
  counters["photons/cells"] = baked.cells;
  counters["density/rays"] = baked.density_rays;
  counters["gather/rays"] = baked.counters.gather_rays;
  counters["gather/shadow_rays"] = baked.counters.shadow_rays;
  counters["gather/bounce_rays"] = baked.counters.bounce_rays;
  counters["gather/bad_samples"] = baked.counters.bad_samples;
  counters["filter/rays"] = baked.counters.filter_rays;
  counters["filter/texels"] = baked.filter.filtered;
  counters["texels/validity_rays"] = baked.counters.validity_rays;
  manifest.photons = baked.photons;
  manifest.rays = baked.photon_rays + baked.density_rays + baked.counters.gather_rays + baked.counters.shadow_rays +
                  baked.counters.bounce_rays + baked.counters.validity_rays + baked.counters.filter_rays;
  manifest.estimated_error = EstimatedError(baked.lights);
}

// Moves the staged files into place and says what was done.
absl::StatusOr<BakeSummary> Conclude(OutputDir& out, const std::filesystem::path& folder, Manifest manifest,
                                     const PhaseClock& clock, double wall_begin, double cpu_begin) {
  manifest.phases = clock.phases();
  BAKEWELL_RETURN_IF_ERROR(WriteManifest(out.Staging(), manifest));
  BakeSummary summary;
  BAKEWELL_ASSIGN_OR_RETURN(summary.files, out.Commit());
  summary.output_dir = folder;
  summary.warnings = manifest.warnings;
  summary.estimated_error = manifest.estimated_error;
  summary.rays = manifest.rays;
  summary.wall_seconds = PhaseClock::WallSeconds() - wall_begin;
  summary.cpu_seconds = PhaseClock::CpuSeconds() - cpu_begin;
  return summary;
}

absl::Status CheckSamples(const GatherCounters& counters) {
  const double samples = static_cast<double>(counters.gather_rays + counters.shadow_rays);
  if (static_cast<double>(counters.bad_samples) <= kMostBadSamples * samples) return absl::OkStatus();
  return absl::InternalError(
      std::to_string(counters.bad_samples) + " of " + std::to_string(static_cast<int64_t>(samples)) +
      " samples were NaN or infinite; lights or emission of this scene are beyond what float can hold");
}

}  // namespace

absl::StatusOr<BakeSummary> Bake(const BakeRequest& request, Progress& progress) {
  const double wall = PhaseClock::WallSeconds(), cpu = PhaseClock::CpuSeconds();
  const tbb::global_control threads = Threads(request.threads);
  PhaseClock clock;
  BAKEWELL_ASSIGN_OR_RETURN(const PreparedLevel prepared,
                            LoadAndPrepare(request.scene_path, request.settings, clock, progress));
  BAKEWELL_ASSIGN_OR_RETURN(const BakedTexels baked, BakeTexels(prepared, request.settings, clock, progress));
  BAKEWELL_RETURN_IF_ERROR(CheckSamples(baked.counters));
  BAKEWELL_ASSIGN_OR_RETURN(OutputDir out, OutputDir::Create(request.output_dir));
  Manifest manifest = MakeManifest(request.scene_path, request.settings, prepared);
  AddBakeFigures(baked, manifest);
  clock.Begin("finish");
  BAKEWELL_RETURN_IF_ERROR(WritePages(prepared, baked, out.Staging(), manifest.files, progress));
  clock.End();
  clock.Begin("write");
  BAKEWELL_RETURN_IF_ERROR(WriteScene(request, prepared, out.Staging(), manifest.files));
  clock.End();
  return Conclude(out, request.output_dir, std::move(manifest), clock, wall, cpu);
}

namespace {

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
  const tbb::global_control threads = Threads(request.threads);
  PhaseClock clock;
  BAKEWELL_ASSIGN_OR_RETURN(const PreparedLevel prepared,
                            LoadAndPrepare(request.scene_path, request.settings, clock, progress));
  Manifest manifest = MakeManifest(request.scene_path, request.settings, prepared);
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
  return Conclude(out, request.output_dir, std::move(manifest), clock, wall, cpu);
}

}  // namespace bakewell
