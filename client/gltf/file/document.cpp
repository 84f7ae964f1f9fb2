#include "client/gltf/file/document.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "client/gltf/file/glb.h"
#include "client/gltf/file/schema.h"
#include "core/artifact/atomic_file.h"

namespace bakewell::gltf {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

absl::Status InvalidAt(const std::string& where, const std::string& reason) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", reason));
}

absl::StatusOr<std::string> DecodeDataUri(std::string_view uri, const std::string& where) {
  const size_t comma = uri.find(',');
  if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64")) {
    return InvalidAt(where, "its data URI is not base64");
  }
  std::string bytes;
  const std::string_view text = uri.substr(comma + 1);
  if (!absl::Base64Unescape({text.data(), text.size()}, &bytes)) return InvalidAt(where, "its base64 is malformed");
  return bytes;
}

// %20 and the like; a malformed escape is an error.
absl::StatusOr<std::string> DecodePercent(std::string_view uri, const std::string& where) {
  std::string text;
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      text += uri[i];
      continue;
    }
    const bool digits = i + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
                        std::isxdigit(static_cast<unsigned char>(uri[i + 2]));
    if (!digits) return InvalidAt(where, "its URI has a malformed % escape");
    text += absl::HexStringToBytes({uri.data() + i + 1, 2});
    i += 2;
  }
  return text;
}

// A relative path without a scheme, a drive, a backslash, a NUL or a step upwards.
bool StaysBelow(const std::string& relative) {
  if (relative.empty() || relative.find_first_of(std::string_view(":\\\0", 3)) != std::string::npos) return false;
  const fs::path path(relative);
  return path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const fs::path& step) { return step == ".."; });
}

// True where `file`, its links resolved, lies below `folder`.
bool LiesIn(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path base = fs::canonical(folder, error);
  if (error) return false;
  const fs::path target = fs::weakly_canonical(file, error);
  return !error && std::mismatch(base.begin(), base.end(), target.begin(), target.end()).first == base.end();
}

absl::StatusOr<std::string> ReadUri(const fs::path& gltf_path, std::string_view uri, const std::string& where) {
  if (uri.starts_with("data:")) return DecodeDataUri(uri, where);
  BAKEWELL_ASSIGN_OR_RETURN(const std::string relative, DecodePercent(uri, where));
  const fs::path folder = gltf_path.has_parent_path() ? gltf_path.parent_path() : fs::path(".");
  if (!StaysBelow(relative) || !LiesIn(folder, folder / relative)) {
    return InvalidAt(where, absl::StrCat("its URI \"", absl::CHexEscape(relative), "\" leaves the file's folder"));
  }
  auto bytes = ReadWholeFile(folder / relative);
  if (!bytes.ok()) return absl::Status(bytes.status().code(), absl::StrCat(where, ": ", bytes.status().message()));
  return bytes;
}

absl::StatusOr<std::string> BufferBytes(const Document& document, int index, std::string_view bin) {
  const json& buffer = document.json["buffers"][static_cast<size_t>(index)];
  const std::string where = NameOf(document.json, "buffers", index);
  const auto uri = buffer.find("uri");
  std::string bytes;
  if (uri != buffer.end()) {
    BAKEWELL_ASSIGN_OR_RETURN(bytes, ReadUri(document.path, uri->get_ref<const std::string&>(), where));
  } else if (index == 0) {
    bytes = bin;
  }
  const auto length = buffer["byteLength"].get<uint64_t>();
  if (bytes.size() < length) {
    return InvalidAt(where, absl::StrCat("byteLength is ", length, ", only ", bytes.size(), " bytes are there"));
  }
  bytes.resize(length);
  return bytes;
}

absl::Status CheckVersion(const json& document) {
  const auto& version = document["asset"]["version"].get_ref<const std::string&>();
  if (!version.starts_with("2.")) return InvalidAt("asset", "version \"" + version + "\" is not 2.x");
  return absl::OkStatus();
}

absl::StatusOr<Document> ParseDocument(const fs::path& path, std::string_view file) {
  BAKEWELL_ASSIGN_OR_RETURN(const Container container, SplitContainer(file));
  Document document;
  document.path = path;
  document.digest = Sha256Of(std::as_bytes(std::span(file)));
  BAKEWELL_ASSIGN_OR_RETURN(document.json, ParseJson(container.json));
  BAKEWELL_RETURN_IF_ERROR(CheckSchema(document.json));
  BAKEWELL_RETURN_IF_ERROR(CheckVersion(document.json));
  const size_t count = document.json.contains("buffers") ? document.json["buffers"].size() : 0;
  for (size_t i = 0; i < count; ++i) {
    BAKEWELL_ASSIGN_OR_RETURN(std::string bytes, BufferBytes(document, static_cast<int>(i), container.bin));
    document.buffers.push_back(std::move(bytes));
  }
  return document;
}

}  // namespace

absl::StatusOr<Document> ReadDocument(const fs::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string file, ReadWholeFile(path));
  return ParseDocument(path, file);
}

absl::StatusOr<std::string_view> ViewBytes(const Document& document, int index) {
  const json& view = document.json["bufferViews"][static_cast<size_t>(index)];
  const std::string& buffer = document.buffers[view["buffer"].get<size_t>()];
  const auto offset = view.value("byteOffset", uint64_t{0}), length = view["byteLength"].get<uint64_t>();
  if (offset > buffer.size() || length > buffer.size() - offset) {
    return InvalidAt(NameOf(document.json, "bufferViews", index),
                     absl::StrCat("bytes [", offset, ", ", offset + length, ") leave its buffer of ", buffer.size()));
  }
  return std::string_view(buffer).substr(offset, length);
}

absl::StatusOr<std::string> ImageBytes(const Document& document, int index) {
  const json& image = document.json["images"][static_cast<size_t>(index)];
  const std::string where = NameOf(document.json, "images", index);
  if (const auto view = image.find("bufferView"); view != image.end()) {
    BAKEWELL_ASSIGN_OR_RETURN(const std::string_view bytes, ViewBytes(document, view->get<int>()));
    return std::string(bytes);
  }
  const auto uri = image.find("uri");
  if (uri == image.end()) return InvalidAt(where, "has neither a uri nor a bufferView");
  return ReadUri(document.path, uri->get_ref<const std::string&>(), where);
}

}  // namespace bakewell::gltf
