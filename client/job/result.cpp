#include "client/job/result.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/artifact/atomic_file.h"
#include "core/artifact/bake_report.h"
#include "core/artifact/level_task.h"
#include "core/atlas/serialize.h"
#include "core/scene/canonical.h"
#include "proto/settings.h"

namespace bakewell {

namespace {

namespace fs = std::filesystem;

std::string PageStem(size_t page) { return absl::StrCat("lightmap-", page); }

// A file that is read once and is no part of the result.
absl::StatusOr<std::string> TakeFile(const fs::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(std::string bytes, ReadWholeFile(path));
  std::error_code error;
  fs::remove(path, error);
  return bytes;
}

absl::Status WriteScene(const Submission& submission, const AtlasLayout& layout, const fs::path& folder) {
  std::vector<LightmapFiles> pages;
  for (size_t page = 0; page < layout.pages.size(); ++page) {
    const std::string stem = PageStem(page);
    pages.push_back({stem + ".irradiance.exr", stem + ".sh.exr", stem + ".variance.exr"});
  }
  return WriteLevel(submission.scene_path, submission.level, layout, pages, folder / "scene.glb");
}

// A file that was fetched, and therefore is what its digest says.
absl::StatusOr<ManifestFile> DescribeFetched(const v1::Job& job, const fs::path& folder, const std::string& name,
                                             const char* kind) {
  for (const v1::Artifact& artifact : job.artifacts()) {
    if (artifact.name() != name) continue;
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(artifact.digest()));
    std::error_code error;
    const uint64_t size_bytes = fs::file_size(folder / name, error);
    if (error) return FileError("look at", folder / name, error.value());
    return ManifestFile{name, kind, size_bytes, digest};
  }
  return absl::DataLossError(absl::StrCat("the job made no ", name));
}

absl::StatusOr<std::vector<ManifestFile>> DescribeFiles(const v1::Job& job, const fs::path& folder, size_t pages) {
  std::vector<ManifestFile> files;
  for (size_t page = 0; page < pages; ++page) {
    for (const level_task::PageFile& one : level_task::kPageFiles) {
      BAKEWELL_ASSIGN_OR_RETURN(ManifestFile file, DescribeFetched(job, folder, PageStem(page) + one.ending, one.kind));
      files.push_back(std::move(file));
    }
  }
  BAKEWELL_ASSIGN_OR_RETURN(ManifestFile scene, DescribeFile(folder / "scene.glb", "scene"));
  files.push_back(std::move(scene));
  return files;
}

}  // namespace

absl::Status StatusOfEnded(const v1::Job& job, const fs::path& scene_path) {
  if (job.state() == v1::DONE) return absl::OkStatus();
  if (job.state() == v1::CANCELLED) return absl::CancelledError("cancelled");
  const auto code =
      job.code() > 0 && job.code() <= 16 ? static_cast<absl::StatusCode>(job.code()) : absl::StatusCode::kAborted;
  return absl::Status(code, absl::StrCat(scene_path.string(), scene_path.empty() ? "" : ": ", job.reason()));
}

std::vector<PhaseTime> PhasesOf(const v1::Job& job) {
  struct Name {
    const char* kind;
    const char* phase;
  };
  constexpr Name kNames[] = {{level_task::kChart.kind, "chart"},   {level_task::kSurvey.kind, "texels"},
                             {level_task::kEmit.kind, "photons"},  {level_task::kDensity.kind, "density"},
                             {level_task::kGather.kind, "gather"}, {level_task::kFinish.kind, "finish"}};
  std::vector<PhaseTime> phases;
  for (const Name& name : kNames) {
    for (const v1::PhaseProgress& phase : job.phases()) {
      if (phase.phase() != name.kind) continue;
      phases.push_back(
          {name.phase, static_cast<double>(phase.wall_us()) * 1e-6, static_cast<double>(phase.run_us()) * 1e-6});
    }
  }
  return phases;
}

absl::StatusOr<Manifest> FetchResult(FarmClient& client, const v1::Job& job, const Submission& submission,
                                     const OutputDir& out) {
  const fs::path& folder = out.Staging();
  BAKEWELL_RETURN_IF_ERROR(client.FetchAll(job, folder));
  BAKEWELL_ASSIGN_OR_RETURN(const std::string layout_bytes, TakeFile(folder / level_task::kLayoutArtifact));
  BAKEWELL_ASSIGN_OR_RETURN(const AtlasLayout layout, ParseLayout(layout_bytes));
  BAKEWELL_ASSIGN_OR_RETURN(const std::string report_json, TakeFile(folder / level_task::kReportArtifact));
  BAKEWELL_ASSIGN_OR_RETURN(const BakeReport report, ParseReport(report_json));
  BAKEWELL_RETURN_IF_ERROR(WriteScene(submission, layout, folder));

  Manifest manifest;
  for (const level_task::KindName& kind : level_task::kAll) {
    manifest.task_versions[kind.kind] = static_cast<int>(kind.code_version);
  }
  manifest.scene_file = submission.scene_path.filename().string();
  manifest.scene_digest = SceneDigest(submission.level.scene);
  manifest.settings_json = SettingsJson(submission.settings);
  manifest.warnings = submission.level.warnings;
  for (const std::string& warning : report.warnings) {
    const bool said = std::find(manifest.warnings.begin(), manifest.warnings.end(), warning) != manifest.warnings.end();
    if (!said) manifest.warnings.push_back(warning);
  }
  manifest.counters = report.counters;
  manifest.rays = report.rays;
  manifest.photons = report.photons;
  manifest.estimated_error = report.estimated_error;
  BAKEWELL_ASSIGN_OR_RETURN(manifest.files, DescribeFiles(job, folder, layout.pages.size()));
  return manifest;
}

absl::StatusOr<BakeSummary> Conclude(OutputDir& out, const fs::path& folder, const Manifest& manifest) {
  BAKEWELL_RETURN_IF_ERROR(WriteManifest(out.Staging(), manifest));
  BakeSummary summary;
  BAKEWELL_ASSIGN_OR_RETURN(summary.files, out.Commit());
  summary.output_dir = folder;
  summary.warnings = manifest.warnings;
  summary.estimated_error = manifest.estimated_error;
  summary.rays = manifest.rays;
  return summary;
}

}  // namespace bakewell
