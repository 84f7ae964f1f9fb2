#pragma once

#include <span>
#include <string>

#include "client/gltf/file/accessor.h"
#include "core/math/vec.h"

namespace bakewell::gltf {

// A document on its way out: the JSON of the input, all of whose buffers and image files are merged into one binary
// chunk. What it does not know it keeps as it is.
class Output {
 public:
  // kInvalidArgument where a buffer view leaves its buffer, or an image file cannot be read.
  static absl::StatusOr<Output> From(const Document& document);

  int AddIndices(std::span<const uint32_t> indices);
  int AddVec2(std::span<const Vec2f> values);
  int AddElements(const Elements& elements, size_t count);
  // Appends an element to a top-level array; its index.
  int Push(const char* array, nlohmann::json element);
  // The whole file. kInvalidArgument above 4 GiB.
  absl::StatusOr<std::string> Glb();

  nlohmann::json json;

 private:
  absl::Status MergeBuffers(const Document& document);
  absl::Status EmbedImages(const Document& document);
  int AddView(std::string_view bytes, int target, size_t stride_bytes);
  int AddAccessor(nlohmann::json header, int view, size_t count);

  std::string bin_;
};

// The object `element.extras`, made where it is missing. Extras that are not an object become its member "extras".
nlohmann::json& ExtrasOf(nlohmann::json& element);

}  // namespace bakewell::gltf
