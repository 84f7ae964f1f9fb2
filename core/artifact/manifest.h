#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status.h"

namespace bakewell {

// The program's version, "0.1.0".
std::string ProgramVersion();

struct ManifestFile {
  std::string name;  // relative to the manifest's folder
  std::string kind;  // irradiance, sh, variance, preview, scene, probe; schema/manifest.md lists them
  uint64_t size_bytes = 0;
  Digest sha256;
};

// What manifest.json says; schema/manifest.md is its page. It follows from scene, settings and code alone, whoever
// baked: what a run took, the program says when it is done.
struct Manifest {
  std::string program = "bakewell";
  std::string version = ProgramVersion();
  std::map<std::string, int> task_versions;  // kind of task to the version of its code
  std::string scene_file;                    // name only: the folder does not say where it was baked
  Digest scene_digest;                       // of the canonical scene
  std::string settings_json = "{}";          // SettingsJson(settings)
  std::map<std::string, int64_t> counters;   // slash names: gather/rays, skip/dark_chart
  int64_t rays = 0;
  int64_t photons = 0;
  double estimated_error = 0;  // relative standard error of the irradiance, root mean square over valid texels
  std::vector<std::string> warnings;
  std::vector<ManifestFile> files;
};

// Size and digest of a file as it is on disk. Errors as ReadWholeFile.
absl::StatusOr<ManifestFile> DescribeFile(const std::filesystem::path& path, std::string kind);

// Indented JSON, members in schema/manifest.md's order, a line break at the end; numbers that are not finite are null.
// kInvalidArgument where settings_json is not a JSON object.
absl::StatusOr<std::string> ManifestJson(const Manifest& manifest);

// ManifestJson to `folder`/manifest.json, atomically.
absl::Status WriteManifest(const std::filesystem::path& folder, const Manifest& manifest);

}  // namespace bakewell
