#include "client/gltf/features.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <string_view>

namespace bakewell::gltf {
namespace {

// Read, or without influence on what is baked.
constexpr std::string_view kKnownExtensions[] = {
    "EXT_mesh_gpu_instancing", "KHR_lights_punctual",   "KHR_materials_emissive_strength", "KHR_materials_ior",
    "KHR_materials_specular",  "KHR_mesh_quantization", "KHR_texture_transform",           "KHR_xmp_json_ld",
};

bool IsKnown(const std::string& extension) {
  return std::find(std::begin(kKnownExtensions), std::end(kKnownExtensions), extension) != std::end(kKnownExtensions);
}

bool HasVertexColors(const tinygltf::Model& model) {
  for (const auto& mesh : model.meshes) {
    for (const auto& primitive : mesh.primitives) {
      if (primitive.attributes.contains("COLOR_0")) return true;
    }
  }
  return false;
}

}  // namespace

absl::Status CheckFeatures(const Source& source, Warnings& warnings) {
  const nlohmann::json& document = source.document.json;
  for (const auto& extension : document.value("extensionsRequired", nlohmann::json::array())) {
    if (IsKnown(extension)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("extensionsRequired: ", extension.get<std::string>(), " is not supported"));
  }
  for (const auto& extension : document.value("extensionsUsed", nlohmann::json::array())) {
    if (!IsKnown(extension)) warnings.Add(absl::StrCat("the extension ", extension.get<std::string>(), " is ignored"));
  }
  if (source.model.scenes.size() > 1) warnings.Add("the file has more than one scene; only its default scene is baked");
  if (HasVertexColors(source.model)) warnings.Add("vertex colours (COLOR_0) are ignored");
  return absl::OkStatus();
}

}  // namespace bakewell::gltf
