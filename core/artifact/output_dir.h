#pragma once

#include <filesystem>
#include <vector>

#include "core/base/status.h"

namespace bakewell {

// A bake's output folder, in which files appear only when the bake is complete. They are written to a hidden staging
// folder inside it and moved into place by Commit(). One thread; movable; owns the staging folder.
//
//   BAKEWELL_ASSIGN_OR_RETURN(OutputDir out, OutputDir::Create("out"));
//   WriteExr(out.Staging() / "lightmap-0.irradiance.exr", image) ...
//   BAKEWELL_ASSIGN_OR_RETURN(std::vector<fs::path> files, out.Commit());
class OutputDir {
 public:
  // Makes `folder` (and its parents) if it is not there, and the staging folder in it. Staging folders that a killed
  // process left behind are removed. kInvalidArgument where `folder` is a file, else as FileError.
  static absl::StatusOr<OutputDir> Create(const std::filesystem::path& folder);

  OutputDir(OutputDir&& other) noexcept;
  OutputDir& operator=(OutputDir&&) = delete;
  // Without Commit(): removes the staging folder, and the folders that Create() made. `folder` is as it was before.
  ~OutputDir();

  // Where to write; flat, no folders in it.
  const std::filesystem::path& Staging() const { return staging_; }

  // Syncs every staged file and moves it into the folder, replacing files of the same name; manifest.json goes first
  // (the old one is removed) and last (the new one is moved), so that a manifest never speaks of half a bake.
  // The final paths, sorted. Call once. kUnavailable, kResourceExhausted: some files may have been moved, the manifest
  // has not.
  absl::StatusOr<std::vector<std::filesystem::path>> Commit();

 private:
  OutputDir() = default;

  std::filesystem::path folder_, staging_;
  std::vector<std::filesystem::path> made_;  // folders that were not there, outermost first
  int lock_ = -1;                            // holds a lock on the staging folder: its owner lives
};

}  // namespace bakewell
