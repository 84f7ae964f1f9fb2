#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/gltf/file/accessor.h"
#include "core/math/vec.h"

namespace bakewell::gltf {

// A primitive as the file has it, in the mesh's frame.
struct PrimitiveData {
  std::vector<Vec3d> position;  // V
  std::vector<Vec3d> normal;    // V, or empty: flat normals are wanted
  std::vector<Vec2f> uv0, uv1;  // V, or empty
  std::vector<uint32_t> index;  // 3 T, strips and fans resolved
  int64_t bad_uvs = 0;          // not finite, and made zero
};

// Why a primitive is left out ("is made of points"), or nothing for triangles, strips and fans.
std::optional<std::string> SkipReason(const Source& source, int mesh, int primitive);

// The primitive's vertices (its POSITION count), and an upper bound of the index count, without reading anything.
struct PrimitiveSize {
  uint64_t vertices = 0, indices = 0;
};
absl::StatusOr<PrimitiveSize> SizeOf(const Source& source, int mesh, int primitive);

// The triangles' vertices, 3 T. Triangles of a strip that repeat an index are how strips are stitched, and are left
// out.
absl::StatusOr<std::vector<uint32_t>> ReadTriangles(const Source& source, int mesh, int primitive);

// Without NORMAL, vertices are not shared: vertex i of the object is vertex ReadTriangles()[i] of the primitive.
bool HasNormals(const Source& source, int mesh, int primitive);

absl::StatusOr<PrimitiveData> ReadPrimitive(const Source& source, int mesh, int primitive);

}  // namespace bakewell::gltf
