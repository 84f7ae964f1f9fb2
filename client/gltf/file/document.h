#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status.h"

namespace bakewell::gltf {

// A glTF file in memory: its JSON, shape-checked (schema.h), and the bytes of every buffer. Move only in spirit: it may
// be large.
struct Document {
  std::filesystem::path path;
  Digest digest;  // of the .gltf or .glb file itself
  nlohmann::json json;
  std::vector<std::string> buffers;  // one per buffers[], exactly byteLength bytes
};

// Reads a .gltf or .glb and its external buffers, which must lie in the file's own folder. Safe on hostile files.
// kNotFound: a file is missing. kInvalidArgument: anything else; messages do not name `path` itself.
absl::StatusOr<Document> ReadDocument(const std::filesystem::path& path);

// The encoded bytes of images[index], from its buffer view, data URI or file. Errors as ReadDocument.
absl::StatusOr<std::string> ImageBytes(const Document& document, int index);

// The bytes of bufferViews[index]; kInvalidArgument where it leaves its buffer.
absl::StatusOr<std::string_view> ViewBytes(const Document& document, int index);

}  // namespace bakewell::gltf
