#include "client/gltf/file/output.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>

#include "client/gltf/file/glb.h"
#include "client/gltf/file/schema.h"

namespace bakewell::gltf {
namespace {

using nlohmann::json;

constexpr int kVertices = 34962, kIndices = 34963, kNoTarget = 0;

template <typename T>
std::string_view BytesOf(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

std::string MimeOf(std::string_view image) { return image.starts_with("\x89PNG") ? "image/png" : "image/jpeg"; }

}  // namespace

absl::StatusOr<Output> Output::From(const Document& document) {
  Output output;
  output.json = document.json;
  BAKEWELL_RETURN_IF_ERROR(output.MergeBuffers(document));
  BAKEWELL_RETURN_IF_ERROR(output.EmbedImages(document));
  return output;
}

absl::Status Output::MergeBuffers(const Document& document) {
  std::vector<size_t> first_byte;
  for (const std::string& buffer : document.buffers) {
    bin_.resize((bin_.size() + 3) / 4 * 4);
    first_byte.push_back(bin_.size());
    bin_ += buffer;
  }
  for (auto& view : json.contains("bufferViews") ? json["bufferViews"] : json::array()) {
    view["byteOffset"] = view.value("byteOffset", uint64_t{0}) + first_byte[view["buffer"].get<size_t>()];
    view["buffer"] = 0;
  }
  return absl::OkStatus();
}

absl::Status Output::EmbedImages(const Document& document) {
  const size_t count = json.contains("images") ? json["images"].size() : 0;
  for (size_t i = 0; i < count; ++i) {
    nlohmann::json& image = json["images"][i];
    const std::string uri = StringOr(image, {"uri"}, "data:");
    if (uri.starts_with("data:")) continue;
    BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, ImageBytes(document, static_cast<int>(i)));
    image.erase("uri");
    image["bufferView"] = AddView(bytes, kNoTarget, 0);
    image["mimeType"] = MimeOf(bytes);
  }
  return absl::OkStatus();
}

int Output::Push(const char* array, nlohmann::json element) {
  json[array].push_back(std::move(element));
  return static_cast<int>(json[array].size()) - 1;
}

int Output::AddView(std::string_view bytes, int target, size_t stride_bytes) {
  bin_.resize((bin_.size() + 3) / 4 * 4);
  nlohmann::json view = {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", bytes.size()}};
  if (target != kNoTarget) view["target"] = target;
  if (stride_bytes > 0) view["byteStride"] = stride_bytes;
  bin_ += bytes;
  return Push("bufferViews", std::move(view));
}

int Output::AddAccessor(nlohmann::json header, int view, size_t count) {
  header["bufferView"] = view;
  header["count"] = count;
  return Push("accessors", std::move(header));
}

int Output::AddIndices(std::span<const uint32_t> indices) {
  const uint32_t largest = *std::max_element(indices.begin(), indices.end());
  // 65535 itself would be a restart index.
  if (largest >= std::numeric_limits<uint16_t>::max()) {
    const int view = AddView(BytesOf(indices), kIndices, 0);
    return AddAccessor({{"componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT}, {"type", "SCALAR"}}, view,
                       indices.size());
  }
  const std::vector<uint16_t> narrow(indices.begin(), indices.end());
  const int view = AddView(BytesOf(std::span(narrow)), kIndices, 0);
  return AddAccessor({{"componentType", TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT}, {"type", "SCALAR"}}, view,
                     indices.size());
}

int Output::AddVec2(std::span<const Vec2f> values) {
  const int view = AddView(BytesOf(values), kVertices, 0);
  return AddAccessor({{"componentType", TINYGLTF_COMPONENT_TYPE_FLOAT}, {"type", "VEC2"}}, view, values.size());
}

int Output::AddElements(const Elements& elements, size_t count) {
  const int view = AddView(elements.bytes, kVertices, elements.padded ? elements.stride_bytes : 0);
  return AddAccessor(elements.header, view, count);
}

absl::StatusOr<std::string> Output::Glb() {
  json.erase("buffers");
  if (!bin_.empty()) json["buffers"] = nlohmann::json::array({{{"byteLength", bin_.size()}}});
  return JoinContainer(json, bin_);
}

nlohmann::json& ExtrasOf(nlohmann::json& element) {
  nlohmann::json& extras = element["extras"];
  if (extras.is_null()) extras = nlohmann::json::object();
  if (!extras.is_object()) extras = {{"extras", extras}};
  return extras;
}

}  // namespace bakewell::gltf
