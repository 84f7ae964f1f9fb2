#include "client/gltf/light.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "client/gltf/file/schema.h"
#include "core/scene/mean_point.h"

namespace bakewell::gltf {
namespace {

using nlohmann::json;

constexpr const char* kExtension = "KHR_lights_punctual";

absl::Status ErrorAt(const std::string& name, const std::string& reason) {
  return absl::InvalidArgumentError(absl::StrCat(name, ": ", reason));
}

std::string NameOfLight(const json& light, size_t index) {
  return absl::StrCat("lights[", index, "]",
                      light.contains("name") ? " \"" + StringOr(light, {"name"}, "") + "\"" : "");
}

Rgb RgbOf(const json& array) { return {array[0].get<float>(), array[1].get<float>(), array[2].get<float>()}; }

// Inner and outer cone angles as KHR_lights_punctual bounds them.
absl::Status ReadCone(const json& light, const std::string& name, PunctualLight& out) {
  const double inner = NumberOr(light, {"spot", "innerConeAngle"}, 0.0);
  const double outer = NumberOr(light, {"spot", "outerConeAngle"}, kPi / 4);
  if (!(inner >= 0 && inner < outer && outer <= kPi / 2 + 1e-6)) {
    return ErrorAt(name, absl::StrCat("cone angles ", inner, " and ", outer, " are not 0 <= inner < outer <= pi/2"));
  }
  out.cos_inner = static_cast<float>(std::cos(inner));
  out.cos_outer = static_cast<float>(std::max(0.0, std::cos(outer)));
  return absl::OkStatus();
}

absl::Status ReadAngularDiameter(const json& light, const std::string& name, PunctualLight& out) {
  const double degrees = NumberOr(light, {"extras", "angularDiameterDeg"}, 0.0);
  if (!(degrees >= 0 && degrees <= 90)) {
    return ErrorAt(name, absl::StrCat("angularDiameterDeg ", degrees, " is outside of [0, 90]"));
  }
  out.angular_diameter_rad = static_cast<float>(degrees * kPi / 180);
  return absl::OkStatus();
}

absl::StatusOr<PunctualLight> ConvertLight(const json& light, const std::string& name, Warnings& warnings) {
  PunctualLight out;
  out.name = light.value("name", "");
  out.intensity = light.contains("color") ? RgbOf(light["color"]) : Rgb{1, 1, 1};
  out.intensity *= light.value("intensity", 1.0f);
  BAKEWELL_RETURN_IF_ERROR(CheckRadiated(name, "its colour times intensity", out.intensity));
  if (light.contains("range"))
    warnings.Add("the range of lights is ignored: light falls off with the square of distance");
  const std::string type = light["type"].get<std::string>();
  if (type == "point") return out;
  if (type == "spot") {
    out.type = LightType::kSpot;
    BAKEWELL_RETURN_IF_ERROR(ReadCone(light, name, out));
    return out;
  }
  if (type != "directional") return ErrorAt(name, "type \"" + type + "\" does not exist");
  out.type = LightType::kDirectional;
  BAKEWELL_RETURN_IF_ERROR(ReadAngularDiameter(light, name, out));
  return out;
}

absl::Status Place(const Transform& world_from_node, const std::string& name, PlacedLight& placed) {
  const Vec3d direction = NormalizeOrZero(world_from_node.Vector({0, 0, -1}));
  const bool needs_axis = placed.light.type != LightType::kPoint;
  if (needs_axis && direction == Vec3d{}) return ErrorAt(name, "its node's transform leaves it no direction");
  if (direction != Vec3d{}) placed.light.direction = ToFloat(direction);
  placed.light.tangent = FrameFromHint(placed.light.direction, ToFloat(world_from_node.Vector({1, 0, 0}))).t;
  placed.position_ws = world_from_node.column[3];
  const Vec3d p = placed.position_ws;
  if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > MeanPoint::kCoordinateLimit_m) {
    return ErrorAt(name, "it lies more than 10^9 m from the origin");
  }
  return absl::OkStatus();
}

// The light of a node, or -1.
int LightOf(const json& node) {
  const json* light = Find(node, {"extensions", kExtension, "light"});
  return light ? light->get<int>() : -1;
}

const json& LightsJson(const Source& source) { return source.document.json["extensions"][kExtension]["lights"]; }

absl::Status ReadRadiance(const json& environment, const char* name, Rgb& out) {
  if (!environment.contains(name)) return ErrorAt("scene.extras.environment", absl::StrCat(name, " is missing"));
  out = RgbOf(environment[name]);
  return CheckRadiated("scene.extras.environment", name, out);
}

// The baked scene's extras.`name`, or null.
const json* SceneExtra(const Source& source, const char* name) {
  const int scene = DefaultScene(source);
  if (scene < 0) return nullptr;
  return Find(source.document.json["scenes"][static_cast<size_t>(scene)], {"extras", name});
}

}  // namespace

absl::Status CheckRadiated(const std::string& name, const std::string& what, Rgb light) {
  if (IsRadiated(light)) return absl::OkStatus();
  if (!IsFinite(light)) return ErrorAt(name, what + " is not finite");
  if (MaxComponent(light) <= kMostRadiated) return ErrorAt(name, what + " is negative");
  return ErrorAt(name, absl::StrCat(what, ", ", MaxComponent(light), ", is above ", kMostRadiated,
                                    ", beyond which errors cannot be told; scale all lights of the level down"));
}

absl::StatusOr<std::vector<PlacedLight>> ReadLights(const Source& source, const std::vector<PlacedNode>& nodes,
                                                    Warnings& warnings) {
  std::vector<PlacedLight> placed;
  for (const PlacedNode& node : nodes) {
    const int index = LightOf(source.document.json["nodes"][static_cast<size_t>(node.node)]);
    if (index < 0) continue;
    const json& light = LightsJson(source)[static_cast<size_t>(index)];
    const std::string name = NameOfLight(light, static_cast<size_t>(index));
    BAKEWELL_ASSIGN_OR_RETURN(const PunctualLight converted, ConvertLight(light, name, warnings));
    placed.push_back({converted, {}});
    BAKEWELL_RETURN_IF_ERROR(Place(node.world_from_node, name, placed.back()));
  }
  return placed;
}

absl::StatusOr<Environment> ReadEnvironment(const Source& source) {
  Environment out;
  const json* extra = SceneExtra(source, "environment");
  if (!extra) return out;
  const json& environment = *extra;
  const std::string type = environment["type"].get<std::string>();
  if (type == "none") return out;
  if (type == "constant") {
    out.type = EnvironmentType::kConstant;
    BAKEWELL_RETURN_IF_ERROR(ReadRadiance(environment, "radiance", out.radiance));
    return out;
  }
  if (type != "gradient") return ErrorAt("scene.extras.environment", "type \"" + type + "\" does not exist");
  out.type = EnvironmentType::kGradient;
  BAKEWELL_RETURN_IF_ERROR(ReadRadiance(environment, "zenith", out.zenith));
  BAKEWELL_RETURN_IF_ERROR(ReadRadiance(environment, "horizon", out.horizon));
  BAKEWELL_RETURN_IF_ERROR(ReadRadiance(environment, "ground", out.ground));
  return out;
}

absl::StatusOr<std::optional<PageHint>> ReadPageHint(const Source& source) {
  const json* lightmap = SceneExtra(source, "lightmap");
  if (!lightmap) return std::optional<PageHint>();
  const PageHint page{(*lightmap)["width"].get<int>(), (*lightmap)["height"].get<int>()};
  const bool fits = page.width >= 1 && page.height >= 1 && page.width <= 65536 && page.height <= 65536;
  if (!fits) {
    return ErrorAt("scene.extras.lightmap", absl::StrCat(page.width, " x ", page.height, " texels, 1 to 65536 a side"));
  }
  return std::optional<PageHint>(page);
}

}  // namespace bakewell::gltf
