#include "client/gltf/primitive.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <numeric>

#include "client/gltf/file/schema.h"

namespace bakewell::gltf {
namespace {

const tinygltf::Primitive& PrimitiveOf(const Source& source, int mesh, int primitive) {
  return source.model.meshes[static_cast<size_t>(mesh)].primitives[static_cast<size_t>(primitive)];
}

absl::Status ErrorAt(const Source& source, int mesh, int primitive, absl::string_view reason) {
  return absl::InvalidArgumentError(
      absl::StrCat(NameOf(source.document.json, "meshes", mesh), ": primitives[", primitive, "]: ", reason));
}

int AccessorOf(const tinygltf::Primitive& primitive, const char* attribute) {
  const auto it = primitive.attributes.find(attribute);
  return it == primitive.attributes.end() ? -1 : it->second;
}

std::vector<uint32_t> FromStrip(const std::vector<uint32_t>& strip) {
  std::vector<uint32_t> triangles;
  for (size_t i = 0; i + 2 < strip.size(); ++i) {
    // Every second triangle is wound the other way around.
    const uint32_t a = strip[i], b = strip[i + 1 + i % 2], c = strip[i + 2 - i % 2];
    if (a != b && b != c && c != a) triangles.insert(triangles.end(), {a, b, c});
  }
  return triangles;
}

std::vector<uint32_t> FromFan(const std::vector<uint32_t>& fan) {
  std::vector<uint32_t> triangles;
  for (size_t i = 1; i + 1 < fan.size(); ++i) triangles.insert(triangles.end(), {fan[i], fan[i + 1], fan[0]});
  return triangles;
}

absl::StatusOr<std::vector<Vec3d>> ReadVec3(const Source& source, int accessor) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> numbers, ReadNumbers(source, accessor, 3));
  std::vector<Vec3d> vectors(numbers.size() / 3);
  for (size_t i = 0; i < vectors.size(); ++i) vectors[i] = {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  return vectors;
}

absl::StatusOr<std::vector<Vec2f>> ReadUvs(const Source& source, int accessor, int64_t& bad) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> numbers, ReadNumbers(source, accessor, 2));
  std::vector<Vec2f> uvs(numbers.size() / 2);
  for (size_t i = 0; i < uvs.size(); ++i) {
    const Vec2f uv{static_cast<float>(numbers[2 * i]), static_cast<float>(numbers[2 * i + 1])};
    const bool finite = std::isfinite(uv.x) && std::isfinite(uv.y);
    uvs[i] = finite ? uv : Vec2f{};
    bad += finite ? 0 : 1;
  }
  return uvs;
}

absl::Status CheckCounts(const Source& source, int mesh, int primitive) {
  const auto& p = PrimitiveOf(source, mesh, primitive);
  const size_t vertices = source.model.accessors[static_cast<size_t>(AccessorOf(p, "POSITION"))].count;
  for (const char* name : {"NORMAL", "TEXCOORD_0", "TEXCOORD_1"}) {
    const int accessor = AccessorOf(p, name);
    if (accessor < 0 || source.model.accessors[static_cast<size_t>(accessor)].count == vertices) continue;
    return ErrorAt(source, mesh, primitive,
                   absl::StrCat(name, " has ", source.model.accessors[static_cast<size_t>(accessor)].count,
                                " elements, POSITION has ", vertices));
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<std::string> SkipReason(const Source& source, int mesh, int primitive) {
  const int mode = PrimitiveOf(source, mesh, primitive).mode;
  if (mode == TINYGLTF_MODE_POINTS) return "is made of points";
  if (mode == TINYGLTF_MODE_LINE || mode == TINYGLTF_MODE_LINE_LOOP || mode == TINYGLTF_MODE_LINE_STRIP) {
    return "is made of lines";
  }
  if (mode > TINYGLTF_MODE_TRIANGLE_FAN) return absl::StrCat("has the unknown mode ", mode);
  const auto& json =
      source.document.json["meshes"][static_cast<size_t>(mesh)]["primitives"][static_cast<size_t>(primitive)];
  if (json.contains("targets")) return "has morph targets";
  return std::nullopt;
}

absl::StatusOr<PrimitiveSize> SizeOf(const Source& source, int mesh, int primitive) {
  const auto& p = PrimitiveOf(source, mesh, primitive);
  const int position = AccessorOf(p, "POSITION");
  if (position < 0) return ErrorAt(source, mesh, primitive, "has no POSITION");
  BAKEWELL_RETURN_IF_ERROR(CheckCounts(source, mesh, primitive));
  PrimitiveSize size;
  size.vertices = source.model.accessors[static_cast<size_t>(position)].count;
  size.indices = p.indices < 0 ? size.vertices : source.model.accessors[static_cast<size_t>(p.indices)].count;
  if (p.mode != TINYGLTF_MODE_TRIANGLES) size.indices *= 3;
  if (size.vertices > std::numeric_limits<uint32_t>::max())
    return ErrorAt(source, mesh, primitive, "has 2^32 vertices");
  return size;
}

bool HasNormals(const Source& source, int mesh, int primitive) {
  return AccessorOf(PrimitiveOf(source, mesh, primitive), "NORMAL") >= 0;
}

absl::StatusOr<std::vector<uint32_t>> ReadTriangles(const Source& source, int mesh, int primitive) {
  BAKEWELL_ASSIGN_OR_RETURN(const PrimitiveSize size, SizeOf(source, mesh, primitive));
  const auto& p = PrimitiveOf(source, mesh, primitive);
  std::vector<uint32_t> index;
  if (p.indices >= 0) {
    BAKEWELL_ASSIGN_OR_RETURN(index, ReadIndices(source, p.indices, size.vertices));
  } else {
    index.resize(size.vertices);
    std::iota(index.begin(), index.end(), 0u);
  }
  if (p.mode == TINYGLTF_MODE_TRIANGLE_STRIP) return FromStrip(index);
  if (p.mode == TINYGLTF_MODE_TRIANGLE_FAN) return FromFan(index);
  if (index.size() % 3 != 0) {
    return ErrorAt(source, mesh, primitive, absl::StrCat(index.size(), " indices do not make triangles"));
  }
  return index;
}

absl::StatusOr<PrimitiveData> ReadPrimitive(const Source& source, int mesh, int primitive) {
  PrimitiveData data;
  BAKEWELL_RETURN_IF_ERROR(SizeOf(source, mesh, primitive).status());
  const auto& p = PrimitiveOf(source, mesh, primitive);
  // Positions first: their range check bounds how many vertices an unindexed primitive really has.
  BAKEWELL_ASSIGN_OR_RETURN(data.position, ReadVec3(source, AccessorOf(p, "POSITION")));
  BAKEWELL_ASSIGN_OR_RETURN(data.index, ReadTriangles(source, mesh, primitive));
  if (const int normal = AccessorOf(p, "NORMAL"); normal >= 0) {
    BAKEWELL_ASSIGN_OR_RETURN(data.normal, ReadVec3(source, normal));
  }
  if (const int uv0 = AccessorOf(p, "TEXCOORD_0"); uv0 >= 0) {
    BAKEWELL_ASSIGN_OR_RETURN(data.uv0, ReadUvs(source, uv0, data.bad_uvs));
  }
  if (const int uv1 = AccessorOf(p, "TEXCOORD_1"); uv1 >= 0) {
    BAKEWELL_ASSIGN_OR_RETURN(data.uv1, ReadUvs(source, uv1, data.bad_uvs));
  }
  return data;
}

}  // namespace bakewell::gltf
