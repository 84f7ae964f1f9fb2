#include "worker/photon/cells.h"

#include <gtest/gtest.h>

#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"

namespace bakewell {
namespace {

// Every random point's cell holds surface, and its centroid is near: within a cell's diagonal, seen along the patch.
void ExpectCellsHoldTheirPoints(const World& world, const SurfaceCells& cells) {
  TestRandom random(1);
  for (int i = 0; i < 20000; ++i) {
    const auto k = static_cast<uint32_t>(i) % static_cast<uint32_t>(world.triangles().size());
    float u = random.Unit(), v = random.Unit();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3f p = world.PointAt(k, u, v, false).position;
    const uint32_t cell = cells.CellAt(k, p);
    const CellPatch& patch = cells.patches()[cells.PatchOf(k)];
    ASSERT_GE(cell, patch.first_cell);
    ASSERT_LT(cell, patch.first_cell + static_cast<uint32_t>(patch.width * patch.height));
    // Slivers that a photon may meet but that are too thin for the rasteriser would make area 0.
    ASSERT_GT(cells.cells()[cell].area, 0);
    const Vec3f d = p - cells.cells()[cell].position;
    EXPECT_LE(std::fabs(Dot(d, patch.t)), 1.001f);
    EXPECT_LE(std::fabs(Dot(d, patch.b)), 1.001f);
  }
}

double TotalArea(const SurfaceCells& cells) {
  double area = 0;
  for (const SurfaceCell& cell : cells.cells()) area += static_cast<double>(cell.area);
  return area;
}

TEST(SurfaceCells, PointsLieInCellsThatHoldThem) {
  SceneBuilder builder;
  builder.AddRoom({0, 0, 0}, {3, 2, 4}, {.lightmapped = false});
  builder.AddSphere({1, 1, 1}, 0.7, 16, {.lightmapped = false});
  const Scene scene = builder.Build();
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  for (const int64_t target : {10, 1000, 20000}) {
    const SurfaceCells cells = SurfaceCells::Build(*world, target);
    ExpectCellsHoldTheirPoints(*world, cells);
    EXPECT_NEAR(TotalArea(cells) / cells.total_area(), 1, 1e-4) << target;  // the sphere's facets lean
  }
}

// A ramp of `turns` turns around the y axis, 0.5 m a turn, between radii 1 and 3, front up: so flat that its normals
// stay within one patch's 35 degrees all the way.
Scene Spiral(double turns) {
  Object ramp;
  ramp.lightmapped = false;
  const int steps = static_cast<int>(24 * turns);
  for (int i = 0; i <= steps; ++i) {
    const double angle = 2 * kPi * i / 24, height = 0.5 * angle / (2 * kPi);
    for (const double r : {1.0, 3.0}) {
      ramp.position.push_back(ToFloat({r * std::cos(angle), height, r * std::sin(angle)}));
    }
  }
  for (int i = 0; i < steps; ++i) {
    const auto a = static_cast<uint32_t>(2 * i);
    ramp.index.insert(ramp.index.end(), {a, a + 2, a + 1, a + 1, a + 2, a + 3});
  }
  Scene scene;
  scene.materials.push_back({});
  scene.objects.push_back(ramp);
  return scene;
}

TEST(SurfaceCells, PatchesThatFoldOverThemselvesAreSplit) {
  const Scene scene = Spiral(2.5);
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  const SurfaceCells cells = SurfaceCells::Build(*world, 2000);
  EXPECT_GE(cells.patches().size(), 3u) << "two and a half turns lie over one another";
  EXPECT_NEAR(TotalArea(cells) / cells.total_area(), 1, 1e-4);
  ExpectCellsHoldTheirPoints(*world, cells);
  // Points one turn apart lie over each other and must not share a cell.
  for (uint32_t k = 0; k + 48 < world->triangles().size(); ++k) {
    const Vec3f low = world->PointAt(k, 0.3f, 0.3f, false).position;
    const Vec3f high = world->PointAt(k + 48, 0.3f, 0.3f, false).position;
    EXPECT_NE(cells.CellAt(k, low), cells.CellAt(k + 48, high)) << k;
  }
}

TEST(SurfaceCells, APlainThatIsSeldomSeenHasLargeCells) {
  // A room of 4 x 3 x 4 m and, around it, a plain of 400 x 400 m, which would take all cells.
  SceneBuilder builder;
  builder.AddRoom({0, 0, 0}, {4, 3, 4}, {.lightmapped = false});
  builder.AddQuad({-200, -1, 200}, {400, 0, 0}, {0, 0, -400}, {.lightmapped = false});
  const Scene scene = builder.Build();
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  std::vector<uint32_t> seen(world->triangles().size(), 500);
  const auto plain = static_cast<uint32_t>(seen.size() - 1);
  seen[plain] = seen[plain - 1] = 20;
  const SurfaceCells even = SurfaceCells::Build(*world, 4000), graded = SurfaceCells::Build(*world, 4000, seen);
  const auto side = [](const SurfaceCells& cells, uint32_t k) { return cells.patches()[cells.PatchOf(k)].cell_side_m; };
  EXPECT_GT(side(even, 0), 4);
  EXPECT_LT(side(graded, 0), 0.5f);
  EXPECT_GE(side(graded, plain), 32 * side(graded, 0));
  EXPECT_NEAR(static_cast<double>(graded.cells().size()), 4000, 1000);
  ExpectCellsHoldTheirPoints(*world, graded);
  // A ray or two that go elsewhere change nothing.
  seen[0] += 3;
  seen[plain] -= 2;
  const SurfaceCells again = SurfaceCells::Build(*world, 4000, seen);
  EXPECT_EQ(side(again, 0), side(graded, 0));
  EXPECT_EQ(side(again, plain), side(graded, plain));
}

TEST(SurfaceCells, HalfATurnNeedsNoSplitForFolding) {
  const Scene scene = Spiral(0.25);
  const auto world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
  const SurfaceCells cells = SurfaceCells::Build(*world, 500);
  EXPECT_LE(cells.patches().size(), 2u);
  EXPECT_NEAR(TotalArea(cells) / cells.total_area(), 1, 1e-4);
}

}  // namespace
}  // namespace bakewell
