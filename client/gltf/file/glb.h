#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace bakewell::gltf {

// The two parts of a glTF file. Views into the bytes that were given.
struct Container {
  std::string_view json;
  std::string_view bin;  // the GLB's BIN chunk; empty for a .gltf
};

// Splits a .glb (known by its magic number) or takes the whole as .gltf text. Safe on hostile bytes; kInvalidArgument.
absl::StatusOr<Container> SplitContainer(std::string_view bytes);

// Parses JSON whose nesting is at most kMaxJsonDepth, so that recursion over it is safe. kInvalidArgument with the
// place.
inline constexpr int kMaxJsonDepth = 128;
absl::StatusOr<nlohmann::json> ParseJson(std::string_view text);

// A .glb file of this JSON (whose buffers[0] must be the BIN chunk) and chunk. kInvalidArgument above 4 GiB.
absl::StatusOr<std::string> JoinContainer(const nlohmann::json& json, std::string_view bin);

}  // namespace bakewell::gltf
