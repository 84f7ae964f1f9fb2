#pragma once

#include "client/gltf/file/accessor.h"
#include "client/gltf/warnings.h"

namespace bakewell::gltf {

// kInvalidArgument for an extension that the file requires and bakewell does not know. Warnings for extensions that are
// used and ignored, for further scenes and for vertex colours.
absl::Status CheckFeatures(const Source& source, Warnings& warnings);

}  // namespace bakewell::gltf
