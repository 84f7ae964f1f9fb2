#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/trace/world.h"

namespace bakewell {

// The surface grid that photons are stored on. Triangles are grouped into patches: connected, facing within 35 degrees
// of each other, projected to a plane of their own without folding over. A patch is cut into equal cells of about its
// cell_side_m that fill its bounding rectangle exactly; every cell knows the exact area of the surface inside it. Cells
// exist for every triangle of the scene, lightmapped or not, and do not depend on anybody's UVs. Both sides of a
// surface have flux of their own. Patches that texels seldom see, a plain around the level, have larger cells.
struct CellPatch {
  Vec3f origin;  // [m]
  Vec3f t, b;    // cells per metre: x = (p - origin) . t, y = (p - origin) . b
  int32_t width = 0, height = 0;
  uint32_t first_cell = 0;  // cell (x, y) is first_cell + y * width + x
  float cell_side_m = 1;
};

struct SurfaceCell {
  float area = 0;  // of the surface inside [m^2]; 0: nothing there
  Vec3f position;  // centroid of that surface [m]
  Vec3f normal;    // unit, area-weighted, front
  // The share of the rays to its front and its back that meet it (World::ShareMet), from points all over it.
  std::array<float, 2> met{};
};

class SurfaceCells {
 public:
  // Chooses the cells' sizes so that about `target_cells` hold surface. seen[k]: how many of equally many rays from
  // each texel met triangle k; without it all patches have cells of one size.
  static SurfaceCells Build(const World& world, int64_t target_cells, std::span<const uint32_t> seen = {});

  const std::vector<CellPatch>& patches() const { return patches_; }
  const std::vector<SurfaceCell>& cells() const { return cells_; }
  uint32_t PatchOf(uint32_t triangle) const { return patch_of_triangle_[triangle]; }
  double total_area() const { return total_area_; }  // [m^2], one side

  // The cell of a point on a triangle.
  uint32_t CellAt(uint32_t triangle, Vec3f position) const {
    const CellPatch& patch = patches_[patch_of_triangle_[triangle]];
    const Vec3f d = position - patch.origin;
    const int x = std::clamp(static_cast<int>(Dot(d, patch.t)), 0, patch.width - 1);
    const int y = std::clamp(static_cast<int>(Dot(d, patch.b)), 0, patch.height - 1);
    return patch.first_cell + static_cast<uint32_t>(y) * static_cast<uint32_t>(patch.width) + static_cast<uint32_t>(x);
  }

 private:
  void AddPatch(const World& world, std::vector<uint32_t> triangles, float cell_side_m);

  double total_area_ = 0;
  std::vector<CellPatch> patches_;
  std::vector<SurfaceCell> cells_;
  std::vector<uint32_t> patch_of_triangle_;
};

}  // namespace bakewell
