#include "client/gltf/file/glb.h"

#include <absl/strings/str_cat.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

namespace bakewell::gltf {
namespace {

constexpr uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;
constexpr size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

uint32_t WordAt(std::string_view bytes, size_t offset) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof(word));
  return word;
}

absl::Status Malformed(const std::string& reason) {
  return absl::InvalidArgumentError(absl::StrCat("GLB container: ", reason));
}

struct Chunk {
  uint32_t type = 0;
  std::string_view data;
};

absl::StatusOr<Chunk> ChunkAt(std::string_view bytes, size_t offset) {
  if (bytes.size() - offset < kChunkHeaderBytes) return Malformed("the file ends inside a chunk header");
  const size_t size = WordAt(bytes, offset);
  const size_t left = bytes.size() - offset - kChunkHeaderBytes;
  if (size > left) return Malformed(absl::StrCat("a chunk of ", size, " bytes is announced, ", left, " are left"));
  return Chunk{WordAt(bytes, offset + 4), bytes.substr(offset + kChunkHeaderBytes, size)};
}

absl::StatusOr<std::string_view> CheckGlbHeader(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return Malformed("the file ends inside the header");
  if (WordAt(bytes, 4) != 2) return Malformed(absl::StrCat("version ", WordAt(bytes, 4), " is not 2"));
  const size_t length = WordAt(bytes, 8);
  if (length > bytes.size()) {
    return Malformed(absl::StrCat("the header announces ", length, " bytes, the file has ", bytes.size()));
  }
  return bytes.substr(0, length);
}

absl::StatusOr<Container> SplitGlb(std::string_view file) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string_view bytes, CheckGlbHeader(file));
  Container container;
  bool has_json = false;
  for (size_t offset = kHeaderBytes; offset < bytes.size();) {
    BAKEWELL_ASSIGN_OR_RETURN(const Chunk chunk, ChunkAt(bytes, offset));
    if (!has_json && chunk.type != kJsonChunk) return Malformed("the first chunk is not JSON");
    if (!has_json) container.json = chunk.data;
    if (has_json && chunk.type == kBinChunk && container.bin.empty()) container.bin = chunk.data;
    has_json = true;
    offset += kChunkHeaderBytes + chunk.data.size();
  }
  if (!has_json) return Malformed("there is no JSON chunk");
  return container;
}

// The first offset at which brackets outside of strings nest too deep.
std::optional<size_t> TooDeepAt(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') ++i;
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    if (c == '{' || c == '[') ++depth;
    if (c == '}' || c == ']') --depth;
    if (depth > kMaxJsonDepth) return i;
  }
  return std::nullopt;
}

void PutWord(std::string& bytes, uint32_t word) { bytes.append(reinterpret_cast<const char*>(&word), sizeof(word)); }

void PutChunk(std::string& bytes, uint32_t type, std::string_view data, char padding) {
  const size_t padded = (data.size() + 3) / 4 * 4;
  PutWord(bytes, static_cast<uint32_t>(padded));
  PutWord(bytes, type);
  bytes.append(data);
  bytes.append(padded - data.size(), padding);
}

}  // namespace

absl::StatusOr<Container> SplitContainer(std::string_view bytes) {
  if (bytes.size() >= 4 && WordAt(bytes, 0) == kGlbMagic) return SplitGlb(bytes);
  return Container{bytes, {}};
}

absl::StatusOr<nlohmann::json> ParseJson(std::string_view text) {
  if (const auto at = TooDeepAt(text)) {
    return absl::InvalidArgumentError(
        absl::StrCat("JSON at byte ", *at, ": nested deeper than ", kMaxJsonDepth, " levels"));
  }
  try {
    return nlohmann::json::parse(text.begin(), text.end());
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("JSON: ", error.what()));
  }
}

absl::StatusOr<std::string> JoinContainer(const nlohmann::json& json, std::string_view bin) {
  const std::string text = json.dump();
  const size_t size = kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + bin.size() + 6;
  if (size > std::numeric_limits<uint32_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat("a .glb cannot hold ", size, " bytes"));
  }
  std::string bytes;
  bytes.reserve(size);
  PutWord(bytes, kGlbMagic);
  PutWord(bytes, 2);
  PutWord(bytes, 0);
  PutChunk(bytes, kJsonChunk, text, ' ');
  if (!bin.empty()) PutChunk(bytes, kBinChunk, bin, '\0');
  const auto length = static_cast<uint32_t>(bytes.size());
  std::memcpy(bytes.data() + 8, &length, sizeof(length));
  return bytes;
}

}  // namespace bakewell::gltf
