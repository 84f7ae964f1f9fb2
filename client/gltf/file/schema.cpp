#include "client/gltf/file/schema.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <string_view>
#include <vector>

namespace bakewell::gltf {
namespace {

using nlohmann::json;

// kSize: a whole number below 2^53; kInteger: below 2^31 (what tinygltf keeps in an int).
enum class Kind { kIndex, kSize, kInteger, kNumber, kBool, kString, kObject, kArray };

// One member. `path` has [] for each element of an array and * for each member of an object; `of` is the array that an
// index points into. A `!` before the last name: required. `length`: the numbers in an array that is walked by [].
struct Rule {
  const char* path;
  Kind kind;
  const char* of = "";
  size_t length = 0;
};

constexpr const char* kLights = "extensions.KHR_lights_punctual.lights";

constexpr Rule kRules[] = {
    {"!asset", Kind::kObject},
    {"asset.!version", Kind::kString},
    {"scene", Kind::kIndex, "scenes"},
    {"extensionsUsed[]", Kind::kString},
    {"extensionsRequired[]", Kind::kString},
    {"scenes[]", Kind::kObject},
    {"scenes[].nodes[]", Kind::kIndex, "nodes"},
    {"scenes[].extras.environment.!type", Kind::kString},
    {"scenes[].extras.environment.radiance[]", Kind::kNumber, "", 3},
    {"scenes[].extras.environment.zenith[]", Kind::kNumber, "", 3},
    {"scenes[].extras.environment.horizon[]", Kind::kNumber, "", 3},
    {"scenes[].extras.environment.ground[]", Kind::kNumber, "", 3},
    {"scenes[].extras.lightmap.!width", Kind::kInteger},
    {"scenes[].extras.lightmap.!height", Kind::kInteger},
    {"nodes[]", Kind::kObject},
    {"nodes[].name", Kind::kString},
    {"nodes[].mesh", Kind::kIndex, "meshes"},
    {"nodes[].skin", Kind::kIndex, "skins"},
    {"nodes[].children[]", Kind::kIndex, "nodes"},
    {"nodes[].matrix[]", Kind::kNumber, "", 16},
    {"nodes[].translation[]", Kind::kNumber, "", 3},
    {"nodes[].rotation[]", Kind::kNumber, "", 4},
    {"nodes[].scale[]", Kind::kNumber, "", 3},
    {"nodes[].extras.lightmapped", Kind::kBool},
    {"nodes[].extras.lightmapDensity", Kind::kNumber},
    {"nodes[].extensions.KHR_lights_punctual.!light", Kind::kIndex, kLights},
    {"nodes[].extensions.EXT_mesh_gpu_instancing.!attributes", Kind::kObject},
    {"nodes[].extensions.EXT_mesh_gpu_instancing.attributes.*", Kind::kIndex, "accessors"},
    {"meshes[]", Kind::kObject},
    {"meshes[].name", Kind::kString},
    {"meshes[].primitives[]", Kind::kObject},
    {"meshes[].primitives[].!attributes", Kind::kObject},
    {"meshes[].primitives[].attributes.*", Kind::kIndex, "accessors"},
    {"meshes[].primitives[].indices", Kind::kIndex, "accessors"},
    {"meshes[].primitives[].material", Kind::kIndex, "materials"},
    {"meshes[].primitives[].mode", Kind::kInteger},
    {"accessors[]", Kind::kObject},
    {"accessors[].bufferView", Kind::kIndex, "bufferViews"},
    {"accessors[].byteOffset", Kind::kSize},
    {"accessors[].!componentType", Kind::kInteger},
    {"accessors[].!count", Kind::kSize},
    {"accessors[].!type", Kind::kString},
    {"accessors[].normalized", Kind::kBool},
    {"accessors[].sparse.!count", Kind::kInteger},
    {"accessors[].sparse.indices.!bufferView", Kind::kIndex, "bufferViews"},
    {"accessors[].sparse.indices.byteOffset", Kind::kInteger},
    {"accessors[].sparse.indices.!componentType", Kind::kInteger},
    {"accessors[].sparse.values.!bufferView", Kind::kIndex, "bufferViews"},
    {"accessors[].sparse.values.byteOffset", Kind::kInteger},
    {"bufferViews[]", Kind::kObject},
    {"bufferViews[].!buffer", Kind::kIndex, "buffers"},
    {"bufferViews[].byteOffset", Kind::kSize},
    {"bufferViews[].!byteLength", Kind::kSize},
    {"bufferViews[].byteStride", Kind::kInteger},
    {"buffers[]", Kind::kObject},
    {"buffers[].!byteLength", Kind::kSize},
    {"buffers[].uri", Kind::kString},
    {"images[]", Kind::kObject},
    {"images[].uri", Kind::kString},
    {"images[].bufferView", Kind::kIndex, "bufferViews"},
    {"samplers[]", Kind::kObject},
    {"samplers[].magFilter", Kind::kInteger},
    {"samplers[].wrapS", Kind::kInteger},
    {"samplers[].wrapT", Kind::kInteger},
    {"textures[]", Kind::kObject},
    {"textures[].source", Kind::kIndex, "images"},
    {"textures[].sampler", Kind::kIndex, "samplers"},
    {"materials[]", Kind::kObject},
    {"materials[].name", Kind::kString},
    {"materials[].alphaMode", Kind::kString},
    {"materials[].alphaCutoff", Kind::kNumber},
    {"materials[].doubleSided", Kind::kBool},
    {"materials[].emissiveFactor[]", Kind::kNumber, "", 3},
    {"materials[].emissiveTexture.!index", Kind::kIndex, "textures"},
    {"materials[].emissiveTexture.texCoord", Kind::kInteger},
    {"materials[].emissiveTexture.extensions.KHR_texture_transform.offset[]", Kind::kNumber, "", 2},
    {"materials[].emissiveTexture.extensions.KHR_texture_transform.scale[]", Kind::kNumber, "", 2},
    {"materials[].emissiveTexture.extensions.KHR_texture_transform.rotation", Kind::kNumber},
    {"materials[].emissiveTexture.extensions.KHR_texture_transform.texCoord", Kind::kInteger},
    {"materials[].extensions.KHR_materials_emissive_strength.emissiveStrength", Kind::kNumber},
    {"materials[].pbrMetallicRoughness", Kind::kObject},
    {"materials[].pbrMetallicRoughness.metallicFactor", Kind::kNumber},
    {"materials[].pbrMetallicRoughness.baseColorFactor[]", Kind::kNumber, "", 4},
    {"materials[].pbrMetallicRoughness.baseColorTexture.!index", Kind::kIndex, "textures"},
    {"materials[].pbrMetallicRoughness.baseColorTexture.texCoord", Kind::kInteger},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.offset[]", Kind::kNumber, "",
     2},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.scale[]", Kind::kNumber, "",
     2},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.rotation", Kind::kNumber},
    {"materials[].pbrMetallicRoughness.baseColorTexture.extensions.KHR_texture_transform.texCoord", Kind::kInteger},
    {"extensions.KHR_lights_punctual.!lights", Kind::kArray},
    {"extensions.KHR_lights_punctual.lights[]", Kind::kObject},
    {"extensions.KHR_lights_punctual.lights[].name", Kind::kString},
    {"extensions.KHR_lights_punctual.lights[].!type", Kind::kString},
    {"extensions.KHR_lights_punctual.lights[].intensity", Kind::kNumber},
    {"extensions.KHR_lights_punctual.lights[].color[]", Kind::kNumber, "", 3},
    {"extensions.KHR_lights_punctual.lights[].spot.innerConeAngle", Kind::kNumber},
    {"extensions.KHR_lights_punctual.lights[].spot.outerConeAngle", Kind::kNumber},
    {"extensions.KHR_lights_punctual.lights[].extras.angularDiameterDeg", Kind::kNumber},
};

constexpr double kLargestNumber = 1e30;
constexpr uint64_t kLargestSize = uint64_t{1} << 53, kLargestInteger = (uint64_t{1} << 31) - 1;

std::string Quoted(const json& element) {
  const auto name = element.is_object() ? element.find("name") : element.end();
  const bool named = element.is_object() && name != element.end() && name->is_string();
  return named ? absl::StrCat(" \"", name->get_ref<const std::string&>(), "\"") : "";
}

std::vector<std::string_view> SplitPath(std::string_view path) {
  std::vector<std::string_view> parts;
  for (size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    parts.push_back(path.substr(0, dot));
    path.remove_prefix(dot + 1);
  }
  parts.push_back(path);
  return parts;
}

// Follows one rule's path through the document.
class Walker {
 public:
  Walker(const json& document, const Rule& rule) : document_(document), rule_(rule) { parts_ = SplitPath(rule.path); }
  absl::Status Walk() { return Visit(document_, 0, ""); }

 private:
  static absl::Status Error(const std::string& where, const std::string& reason) {
    return absl::InvalidArgumentError(absl::StrCat(where.empty() ? "the document" : where, ": ", reason));
  }
  static std::string Join(const std::string& where, std::string_view name) {
    return where.empty() ? std::string(name) : absl::StrCat(where, ": ", std::string(name));
  }

  absl::Status Visit(const json& value, size_t part, const std::string& where) {
    if (part == parts_.size()) return CheckLeaf(value, where);
    if (!value.is_object()) return Error(where, "is not a JSON object");
    if (parts_[part] == "*") return VisitMembers(value, part, where);
    return VisitMember(value, part, where);
  }

  absl::Status VisitMembers(const json& value, size_t part, const std::string& where) {
    for (const auto& [name, member] : value.items()) {
      BAKEWELL_RETURN_IF_ERROR(Visit(member, part + 1, Join(where, name)));
    }
    return absl::OkStatus();
  }

  absl::Status VisitMember(const json& value, size_t part, const std::string& where) {
    std::string_view name = parts_[part];
    const bool required = name.front() == '!';
    if (required) name.remove_prefix(1);
    const bool each = name.ends_with("[]");
    if (each) name.remove_suffix(2);
    const auto member = value.find(name);
    if (member == value.end())
      return required ? Error(where, absl::StrCat(std::string(name), " is missing")) : absl::OkStatus();
    // Extras may be anything; only objects can hold what is looked for.
    if (name == "extras" && !member->is_object()) return absl::OkStatus();
    return each ? VisitElements(*member, part, Join(where, name)) : Visit(*member, part + 1, Join(where, name));
  }

  absl::Status VisitElements(const json& array, size_t part, const std::string& where) {
    if (!array.is_array()) return Error(where, "is not a JSON array");
    const bool last = part + 1 == parts_.size();
    if (last && rule_.length > 0 && array.size() != rule_.length) {
      return Error(where, absl::StrCat("has ", array.size(), " elements, ", rule_.length, " are needed"));
    }
    for (size_t i = 0; i < array.size(); ++i) {
      BAKEWELL_RETURN_IF_ERROR(Visit(array[i], part + 1, absl::StrCat(where, "[", i, "]", Quoted(array[i]))));
    }
    return absl::OkStatus();
  }

  absl::Status CheckLeaf(const json& value, const std::string& where) const {
    switch (rule_.kind) {
      case Kind::kIndex:
        return CheckIndex(value, where);
      case Kind::kSize:
        return CheckInteger(value, where, kLargestSize);
      case Kind::kInteger:
        return CheckInteger(value, where, kLargestInteger);
      case Kind::kNumber:
        return CheckNumber(value, where);
      case Kind::kBool:
        return value.is_boolean() ? absl::OkStatus() : Error(where, "is not true or false");
      case Kind::kString:
        return value.is_string() ? absl::OkStatus() : Error(where, "is not a string");
      case Kind::kObject:
        return value.is_object() ? absl::OkStatus() : Error(where, "is not a JSON object");
      case Kind::kArray:
        return value.is_array() ? absl::OkStatus() : Error(where, "is not a JSON array");
    }
    return absl::OkStatus();
  }

  static absl::Status CheckInteger(const json& value, const std::string& where, uint64_t largest) {
    if (!value.is_number_unsigned() || value.get<uint64_t>() > largest) {
      return Error(where, absl::StrCat(value.dump(), " is not a whole number of 0 to ", largest));
    }
    return absl::OkStatus();
  }

  static absl::Status CheckNumber(const json& value, const std::string& where) {
    if (!value.is_number() || !(std::abs(value.get<double>()) <= kLargestNumber)) {
      return Error(where, absl::StrCat(value.dump(), " is not a number of magnitude up to ", kLargestNumber));
    }
    return absl::OkStatus();
  }

  absl::Status CheckIndex(const json& value, const std::string& where) const {
    const size_t size = TargetSize();
    if (value.is_number_unsigned() && value.get<uint64_t>() < size) return absl::OkStatus();
    return Error(where,
                 absl::StrCat(value.dump(), " is not an index into ", rule_.of, ", which has ", size, " elements"));
  }

  size_t TargetSize() const {
    const json* at = &document_;
    for (const std::string_view name : SplitPath(rule_.of)) {
      const auto member = at->is_object() ? at->find(name) : at->end();
      if (!at->is_object() || member == at->end()) return 0;
      at = &*member;
    }
    return at->is_array() ? at->size() : 0;
  }

  const json& document_;
  const Rule& rule_;
  std::vector<std::string_view> parts_;
};

}  // namespace

absl::Status CheckSchema(const json& document) {
  for (const Rule& rule : kRules) BAKEWELL_RETURN_IF_ERROR(Walker(document, rule).Walk());
  return absl::OkStatus();
}

const json* Find(const json& value, std::initializer_list<const char*> path) {
  const json* at = &value;
  for (const char* name : path) {
    if (!at->is_object()) return nullptr;
    const auto it = at->find(name);
    if (it == at->end()) return nullptr;
    at = &*it;
  }
  return at;
}

double NumberOr(const json& value, std::initializer_list<const char*> path, double otherwise) {
  const json* number = Find(value, path);
  return number ? number->get<double>() : otherwise;
}

std::string StringOr(const json& value, std::initializer_list<const char*> path, const char* otherwise) {
  const json* text = Find(value, path);
  return text ? text->get<std::string>() : otherwise;
}

std::string NameOf(const json& document, const std::string& array, int index) {
  return absl::StrCat(array, "[", index, "]", Quoted(document.at(array).at(static_cast<size_t>(index))));
}

}  // namespace bakewell::gltf
