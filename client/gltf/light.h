#pragma once

#include <vector>

#include "client/gltf/file/placement.h"
#include "client/gltf/warnings.h"
#include "core/scene/scene.h"

namespace bakewell::gltf {

struct PlacedLight {
  PunctualLight light;  // all but position
  Vec3d position_ws;
};

// kInvalidArgument unless IsRadiated(light): "name: what is negative", and so on.
absl::Status CheckRadiated(const std::string& name, const std::string& what, Rgb light);

// KHR_lights_punctual of every placed node, in their order. Radiometric 1:1 (theory.md 1); extras.angularDiameterDeg of
// a directional light is its angular diameter. kInvalidArgument naming the light: negative, too great or unknown
// values, an axis that the node's transform squashes to nothing, a position beyond 10^9 m.
absl::StatusOr<std::vector<PlacedLight>> ReadLights(const Source& source, const std::vector<PlacedNode>& nodes,
                                                    Warnings& warnings);

// scenes[i].extras.environment {type: none | constant | gradient, ...}; none where absent.
absl::StatusOr<Environment> ReadEnvironment(const Source& source);

// scenes[i].extras.lightmap {width, height}, 1 to 65536 each.
absl::StatusOr<std::optional<PageHint>> ReadPageHint(const Source& source);

}  // namespace bakewell::gltf
