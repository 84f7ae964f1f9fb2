#pragma once

#include <tiny_gltf.h>

#include <vector>

#include "client/gltf/file/document.h"

namespace bakewell::gltf {

// The typed view of a document: accessors, buffer views, meshes, nodes, scenes, textures, samplers. Buffers, images,
// extras and extensions are left out: buffers stay in the document, and tinygltf neither opens files nor recurses into
// what strangers wrote. Every index is in range (schema.h). kInvalidArgument with tinygltf's reason.
absl::StatusOr<tinygltf::Model> ToModel(const Document& document);

// Decoded pixels, 8 bits a channel, RGBA: 4 * width * height bytes.
struct Pixels {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;
};

// Decodes a PNG or JPEG whose header announces at most `max_pixels` pixels; nothing is allocated for more.
// kInvalidArgument without naming the image.
absl::StatusOr<Pixels> DecodeImage(std::string_view bytes, int64_t max_pixels);

}  // namespace bakewell::gltf
