#pragma once

#include <filesystem>
#include <string>

#include "client/gltf/level.h"
#include "core/artifact/settings.h"

namespace bakewell {

// A level as a coordinator gets it: the environment of the settings has moved into the scene.
struct Submission {
  std::filesystem::path scene_path;
  BakeSettings settings;       // as the user gave them
  LoadedLevel level;           // with the environment that is baked
  std::string scene_bytes;     // SerializeScene
  std::string settings_bytes;  // a serialised v1::BakeSettings
};

// Errors as LoadLevel.
absl::StatusOr<Submission> MakeSubmission(const std::filesystem::path& scene_path, const BakeSettings& settings);

}  // namespace bakewell
