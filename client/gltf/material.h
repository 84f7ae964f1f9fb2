#pragma once

#include <map>
#include <vector>

#include "client/gltf/file/accessor.h"
#include "client/gltf/level.h"
#include "client/gltf/warnings.h"

namespace bakewell::gltf {

// Reads materials and the textures that they use, each once, into a scene. What is read and what is ignored with a
// warning: README.md.
class MaterialReader {
 public:
  // All must outlive the reader.
  MaterialReader(const Source& source, const LoadLimits& limits, Scene& scene, Warnings& warnings)
      : source_(source), limits_(limits), scene_(scene), warnings_(warnings) {}

  // The index in scene.materials of materials[index], or of glTF's default material for -1. kInvalidArgument naming
  // material or image: factors that are negative, images that are missing, malformed or too large.
  absl::StatusOr<int> Read(int index);

 private:
  absl::StatusOr<Material> Convert(int index);
  absl::Status ReadBase(const nlohmann::json& material, const std::string& name, Material& out);
  absl::Status ReadEmission(const nlohmann::json& material, const std::string& name, Material& out);
  absl::StatusOr<TextureRef> ReadTexture(const nlohmann::json& info, const std::string& name);
  absl::StatusOr<int> TextureOf(int texture, const std::string& name);
  absl::StatusOr<const Pixels*> PixelsOf(int image);

  const Source& source_;
  const LoadLimits& limits_;
  Scene& scene_;
  Warnings& warnings_;
  std::map<int, int> materials_, textures_;  // file's index -> scene's
  std::map<int, Pixels> images_;
  int64_t total_pixels_ = 0;
};

}  // namespace bakewell::gltf
