#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/math/vec.h"
#include "server/chart/atlas.h"

namespace bakewell::chart {

// A Wavefront OBJ as triangles; polygons are fanned.
struct ObjMesh {
  std::vector<Vec3f> position;  // V
  std::vector<uint32_t> index;  // 3 T
};

// Reads through OpenMesh's reader. kNotFound: no such file; kInvalidArgument: not an OBJ with faces. Safe on hostile
// files as far as OpenMesh is; indices are checked.
absl::StatusOr<ObjMesh> ReadObj(const std::filesystem::path& path);

// The text that tools/uv_eval.cpp reads: "# atlas W H", every input vertex as v, every output vertex as vt in [0,1], "g
// chart_K" before the faces of chart K (1000000 * page + number) and "g none_1" before those without a chart.
std::string FormatObj(const ObjMesh& mesh, const Atlas& atlas);

}  // namespace bakewell::chart
