#include "client/gltf/material.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>

#include "client/gltf/file/schema.h"
#include "client/gltf/light.h"

namespace bakewell::gltf {
namespace {

using nlohmann::json;

constexpr int kNearest = 9728, kClampToEdge = 33071, kMirroredRepeat = 33648, kRepeat = 10497;

Rgb RgbOf(const json& array) { return {array[0].get<float>(), array[1].get<float>(), array[2].get<float>()}; }

Vec2f Vec2Or(const json* array, Vec2f otherwise) {
  return array ? Vec2f{(*array)[0].get<float>(), (*array)[1].get<float>()} : otherwise;
}

absl::Status ErrorAt(const std::string& name, const std::string& reason) {
  return absl::InvalidArgumentError(absl::StrCat(name, ": ", reason));
}

absl::StatusOr<WrapMode> WrapOf(int mode, const std::string& name) {
  if (mode == kRepeat) return WrapMode::kRepeat;
  if (mode == kClampToEdge) return WrapMode::kClampToEdge;
  if (mode == kMirroredRepeat) return WrapMode::kMirroredRepeat;
  return ErrorAt(name, absl::StrCat("wrap mode ", mode, " does not exist"));
}

absl::StatusOr<AlphaMode> AlphaModeOf(const json& material, const std::string& name) {
  const std::string mode = material.value("alphaMode", "OPAQUE");
  if (mode == "OPAQUE") return AlphaMode::kOpaque;
  if (mode == "MASK") return AlphaMode::kMask;
  if (mode == "BLEND") return AlphaMode::kBlend;
  return ErrorAt(name, "alphaMode \"" + mode + "\" does not exist");
}

float Clamp01(float value, const std::string& what, Warnings& warnings) {
  if (value < 0 || value > 1) warnings.Add(what + " is outside of [0, 1] and was clamped");
  return std::clamp(value, 0.0f, 1.0f);
}

void WarnOfIgnored(const json& material, Warnings& warnings) {
  if (material.contains("normalTexture")) warnings.Add("normal textures are ignored: light is baked on the geometry");
  if (Find(material, {"pbrMetallicRoughness", "metallicRoughnessTexture"}) ||
      NumberOr(material, {"pbrMetallicRoughness", "metallicFactor"}, 0) > 0) {
    warnings.Add("metallic factors and textures are ignored: every surface reflects diffusely with its base colour");
  }
}

}  // namespace

absl::StatusOr<int> MaterialReader::Read(int index) {
  if (const auto it = materials_.find(index); it != materials_.end()) return it->second;
  BAKEWELL_ASSIGN_OR_RETURN(Material material, Convert(index));
  scene_.materials.push_back(std::move(material));
  return materials_[index] = static_cast<int>(scene_.materials.size()) - 1;
}

absl::StatusOr<Material> MaterialReader::Convert(int index) {
  Material out;
  if (index < 0) return out;
  const json& material = source_.document.json["materials"][static_cast<size_t>(index)];
  const std::string name = NameOf(source_.document.json, "materials", index);
  out.name = material.value("name", "");
  BAKEWELL_RETURN_IF_ERROR(ReadBase(material, name, out));
  BAKEWELL_RETURN_IF_ERROR(ReadEmission(material, name, out));
  BAKEWELL_ASSIGN_OR_RETURN(out.alpha_mode, AlphaModeOf(material, name));
  out.alpha_cutoff = static_cast<float>(NumberOr(material, {"alphaCutoff"}, 0.5));
  out.double_sided = material.value("doubleSided", false);
  WarnOfIgnored(material, warnings_);
  return out;
}

absl::Status MaterialReader::ReadBase(const json& material, const std::string& name, Material& out) {
  if (const json* factor = Find(material, {"pbrMetallicRoughness", "baseColorFactor"})) {
    const Rgb color = RgbOf(*factor);
    for (int c = 0; c < 3; ++c) out.base_color[c] = Clamp01(color[c], name + ": baseColorFactor", warnings_);
    out.base_alpha = Clamp01((*factor)[3].get<float>(), name + ": baseColorFactor", warnings_);
  }
  if (const json* info = Find(material, {"pbrMetallicRoughness", "baseColorTexture"})) {
    BAKEWELL_ASSIGN_OR_RETURN(out.base_texture, ReadTexture(*info, name));
  }
  return absl::OkStatus();
}

absl::Status MaterialReader::ReadEmission(const json& material, const std::string& name, Material& out) {
  const double strength =
      NumberOr(material, {"extensions", "KHR_materials_emissive_strength", "emissiveStrength"}, 1.0);
  if (strength < 0) return ErrorAt(name, absl::StrCat("emissiveStrength ", strength, " is negative"));
  if (const json* factor = Find(material, {"emissiveFactor"})) {
    out.emission = RgbOf(*factor) * static_cast<float>(strength);
    BAKEWELL_RETURN_IF_ERROR(CheckRadiated(name, "its emission", out.emission));
  }
  const json* info = Find(material, {"emissiveTexture"});
  if (!info || out.emission == Rgb{}) return absl::OkStatus();
  BAKEWELL_ASSIGN_OR_RETURN(out.emission_texture, ReadTexture(*info, name));
  return absl::OkStatus();
}

absl::StatusOr<TextureRef> MaterialReader::ReadTexture(const json& info, const std::string& name) {
  TextureRef ref;
  ref.texcoord = info.value("texCoord", 0);
  if (const json* transform = Find(info, {"extensions", "KHR_texture_transform"})) {
    ref.offset = Vec2Or(Find(*transform, {"offset"}), {0, 0});
    ref.scale = Vec2Or(Find(*transform, {"scale"}), {1, 1});
    ref.rotation_rad = static_cast<float>(NumberOr(*transform, {"rotation"}, 0));
    ref.texcoord = transform->value("texCoord", ref.texcoord);
  }
  if (ref.texcoord > 1) {
    warnings_.Add(absl::StrCat(name, ": a texture on TEXCOORD_", ref.texcoord, " is ignored, only 0 and 1 are read"));
    return TextureRef{};
  }
  if (ref.texcoord == 1) {
    warnings_.Add(name + ": a texture uses TEXCOORD_1, which generated lightmap charts replace in scene.glb");
  }
  BAKEWELL_ASSIGN_OR_RETURN(ref.texture, TextureOf(info["index"].get<int>(), name));
  return ref.texture < 0 ? TextureRef{} : ref;
}

absl::StatusOr<int> MaterialReader::TextureOf(int texture, const std::string& name) {
  if (const auto it = textures_.find(texture); it != textures_.end()) return it->second;
  const json& json_texture = source_.document.json["textures"][static_cast<size_t>(texture)];
  const std::string where = NameOf(source_.document.json, "textures", texture);
  if (!json_texture.contains("source")) {
    warnings_.Add(absl::StrCat(name, ": ", where, " has no PNG or JPEG source and is ignored"));
    return -1;
  }
  json sampler = json::object();
  if (json_texture.contains("sampler"))
    sampler = source_.document.json["samplers"][json_texture["sampler"].get<size_t>()];
  BAKEWELL_ASSIGN_OR_RETURN(const Pixels* pixels, PixelsOf(json_texture["source"].get<int>()));
  Texture out{pixels->width, pixels->height, {}, {}, sampler.value("magFilter", 0) == kNearest, pixels->rgba};
  BAKEWELL_ASSIGN_OR_RETURN(out.wrap_u, WrapOf(sampler.value("wrapS", kRepeat), where));
  BAKEWELL_ASSIGN_OR_RETURN(out.wrap_v, WrapOf(sampler.value("wrapT", kRepeat), where));
  scene_.textures.push_back(std::move(out));
  return textures_[texture] = static_cast<int>(scene_.textures.size()) - 1;
}

absl::StatusOr<const Pixels*> MaterialReader::PixelsOf(int image) {
  if (const auto it = images_.find(image); it != images_.end()) return &it->second;
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, ImageBytes(source_.document, image));
  const int64_t left = limits_.max_total_pixels - total_pixels_;
  auto pixels = DecodeImage(bytes, std::min(limits_.max_image_pixels, left));
  if (!pixels.ok()) {
    return ErrorAt(NameOf(source_.document.json, "images", image), std::string(pixels.status().message()));
  }
  total_pixels_ += int64_t{pixels->width} * pixels->height;
  return &(images_[image] = *std::move(pixels));
}

}  // namespace bakewell::gltf
