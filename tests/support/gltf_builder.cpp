#include "tests/support/gltf_builder.h"

#include <absl/strings/escaping.h>

#include <cstring>
#include <fstream>

namespace bakewell {
namespace {

using nlohmann::json;

constexpr int kFloat = 5126, kUnsignedInt = 5125;

void PutLittle(std::string& bytes, uint32_t word) { bytes.append(reinterpret_cast<const char*>(&word), sizeof(word)); }

void PutBig(std::string& bytes, uint32_t word) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(word >> shift & 0xFF);
}

void PutGlbChunk(std::string& bytes, const char (&type)[5], std::string data, char padding) {
  while (data.size() % 4 != 0) data += padding;
  PutLittle(bytes, static_cast<uint32_t>(data.size()));
  bytes.append(type, 4);
  bytes += data;
}

// CRC-32 of PNG chunks (ISO 3309), bit by bit.
uint32_t Crc32(const std::string& bytes) {
  uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

uint32_t Adler32(const std::string& bytes) {
  uint32_t a = 1, b = 0;
  for (const char byte : bytes) {
    a = (a + static_cast<uint8_t>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

void PutPngChunk(std::string& bytes, const std::string& type, const std::string& data) {
  PutBig(bytes, static_cast<uint32_t>(data.size()));
  bytes += type + data;
  PutBig(bytes, Crc32(type + data));
}

// A zlib stream of stored blocks.
std::string Stored(const std::string& data) {
  std::string stream = "\x78\x01";
  for (size_t at = 0; at < data.size(); at += 65535) {
    const size_t size = std::min<size_t>(65535, data.size() - at);
    const auto length = static_cast<uint16_t>(size), complement = static_cast<uint16_t>(~length);
    stream += at + size == data.size() ? '\1' : '\0';
    stream.append(reinterpret_cast<const char*>(&length), 2);
    stream.append(reinterpret_cast<const char*>(&complement), 2);
    stream += data.substr(at, size);
  }
  PutBig(stream, Adler32(data));
  return stream;
}

template <typename T>
int AddFloats(GltfBuilder& builder, const std::vector<T>& values, const char* type) {
  return builder.AddAccessor(std::as_bytes(std::span(values)), kFloat, type, values.size());
}

}  // namespace

GltfBuilder::GltfBuilder() {
  json["asset"]["version"] = "2.0";
  json["scene"] = 0;
  json["scenes"] = json::array({{{"nodes", json::array()}}});
}

int GltfBuilder::Push(const char* array, nlohmann::json element) {
  json[array].push_back(std::move(element));
  return static_cast<int>(json[array].size()) - 1;
}

int GltfBuilder::AddView(std::span<const std::byte> bytes, int stride) {
  bin.resize((bin.size() + 3) / 4 * 4);
  nlohmann::json view = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride;
  bin.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  json["buffers"] = json::array({{{"byteLength", bin.size()}}});
  return Push("bufferViews", view);
}

int GltfBuilder::AddAccessor(std::span<const std::byte> bytes, int component_type, const std::string& type,
                             size_t count) {
  const int view = AddView(bytes);
  return Push("accessors", {{"bufferView", view}, {"componentType", component_type}, {"type", type}, {"count", count}});
}

int GltfBuilder::AddVec3(const std::vector<Vec3f>& values) { return AddFloats(*this, values, "VEC3"); }
int GltfBuilder::AddVec2(const std::vector<Vec2f>& values) { return AddFloats(*this, values, "VEC2"); }
int GltfBuilder::AddVec4(const std::vector<std::array<float, 4>>& values) { return AddFloats(*this, values, "VEC4"); }

int GltfBuilder::AddIndices(const std::vector<uint32_t>& values) {
  return AddAccessor(std::as_bytes(std::span(values)), kUnsignedInt, "SCALAR", values.size());
}

int GltfBuilder::AddMesh(const nlohmann::json& attributes, const nlohmann::json& members) {
  nlohmann::json primitive = members;
  primitive["attributes"] = attributes;
  return Push("meshes", {{"primitives", json::array({primitive})}});
}

int GltfBuilder::AddNode(const nlohmann::json& node) {
  const int index = Push("nodes", node);
  json["scenes"][0]["nodes"].push_back(index);
  return index;
}

int GltfBuilder::AddMaterial(const nlohmann::json& material) { return Push("materials", material); }

int GltfBuilder::AddLight(const nlohmann::json& light) {
  auto& lights = json["extensions"]["KHR_lights_punctual"]["lights"];
  lights.push_back(light);
  return static_cast<int>(lights.size()) - 1;
}

int GltfBuilder::AddTexture(const std::string& encoded, const std::string& mime) {
  const int view = AddView(std::as_bytes(std::span(encoded)));
  const int image = Push("images", {{"bufferView", view}, {"mimeType", mime}});
  return Push("textures", {{"source", image}});
}

std::string GltfBuilder::Glb() const {
  std::string chunks;
  PutGlbChunk(chunks, "JSON", json.dump(), ' ');
  if (!bin.empty()) PutGlbChunk(chunks, "BIN\0", bin, '\0');
  std::string file = "glTF";
  PutLittle(file, 2);
  PutLittle(file, static_cast<uint32_t>(12 + chunks.size()));
  return file + chunks;
}

std::string GltfBuilder::Gltf() const {
  nlohmann::json document = json;
  if (!bin.empty()) {
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + absl::Base64Escape(bin);
  }
  return document.dump();
}

std::filesystem::path GltfBuilder::Write(const std::filesystem::path& path) const {
  std::ofstream file(path, std::ios::binary);
  file << (path.extension() == ".glb" ? Glb() : Gltf());
  return path;
}

GltfBuilder QuadGltf() {
  GltfBuilder builder;
  const nlohmann::json attributes = {{"POSITION", builder.AddVec3({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})},
                                     {"NORMAL", builder.AddVec3({{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}})},
                                     {"TEXCOORD_0", builder.AddVec2({{0, 0}, {1, 0}, {1, 1}, {0, 1}})},
                                     {"TEXCOORD_1", builder.AddVec2({{0, 0}, {0.5f, 0}, {0.5f, 0.5f}, {0, 0.5f}})}};
  const int mesh = builder.AddMesh(attributes, {{"indices", builder.AddIndices({0, 1, 2, 0, 2, 3})}});
  builder.AddNode({{"name", "quad"}, {"mesh", mesh}});
  return builder;
}

std::string EncodePng(int width, int height, const std::vector<uint8_t>& rgba) {
  std::string header;
  PutBig(header, static_cast<uint32_t>(width));
  PutBig(header, static_cast<uint32_t>(height));
  header += std::string("\x08\x06\x00\x00\x00", 5);
  std::string rows;
  for (int y = 0; y < height; ++y) {
    rows += '\0';
    rows.append(reinterpret_cast<const char*>(rgba.data()) + 4 * static_cast<size_t>(y) * static_cast<size_t>(width),
                4 * static_cast<size_t>(width));
  }
  std::string file = "\x89PNG\r\n\x1a\n";
  PutPngChunk(file, "IHDR", header);
  PutPngChunk(file, "IDAT", Stored(rows));
  PutPngChunk(file, "IEND", "");
  return file;
}

}  // namespace bakewell
