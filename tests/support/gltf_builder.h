#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "core/math/vec.h"

namespace bakewell {

// A glTF file in memory, for tests: `json` is the document and may be changed at will, also into what no loader should
// accept; the Add functions append to it and to the one binary buffer, and return the new element's index.
class GltfBuilder {
 public:
  GltfBuilder();

  // One buffer view of these bytes, aligned to 4. stride 0: not written.
  int AddView(std::span<const std::byte> bytes, int stride = 0);
  // A tightly packed accessor: type SCALAR, VEC2, VEC3 or VEC4; component_type as in glTF.
  int AddAccessor(std::span<const std::byte> bytes, int component_type, const std::string& type, size_t count);
  int AddVec3(const std::vector<Vec3f>& values);
  int AddVec2(const std::vector<Vec2f>& values);
  int AddVec4(const std::vector<std::array<float, 4>>& values);
  int AddIndices(const std::vector<uint32_t>& values);
  // A mesh of one primitive: attributes by name, further members of the primitive ({"indices", 3}).
  int AddMesh(const nlohmann::json& attributes, const nlohmann::json& members = nlohmann::json::object());
  // A node of the scene (not a child) with these members.
  int AddNode(const nlohmann::json& node);
  int AddMaterial(const nlohmann::json& material);
  int AddLight(const nlohmann::json& light);
  // An image in the buffer, and a texture of it without a sampler. Returns the texture.
  int AddTexture(const std::string& encoded, const std::string& mime = "image/png");

  // The two kinds of file. The .gltf has its buffer as a data URI.
  std::string Glb() const;
  std::string Gltf() const;
  // Writes Glb() or Gltf(), by the extension of the name.
  std::filesystem::path Write(const std::filesystem::path& path) const;

  nlohmann::json json;
  std::string bin;

 private:
  int Push(const char* array, nlohmann::json element);
};

// Two triangles over [0,1] x [0,1] in the plane z = 0, front towards +z, shared corners, with NORMAL, TEXCOORD_0 and
// TEXCOORD_1: the mesh of one node "quad".
GltfBuilder QuadGltf();

// A PNG of width x height RGBA pixels, stored without compression.
std::string EncodePng(int width, int height, const std::vector<uint8_t>& rgba);

}  // namespace bakewell
