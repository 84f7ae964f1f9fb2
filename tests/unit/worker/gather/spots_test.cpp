#include "worker/gather/spots.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"
#include "tests/support/statistics.h"
#include "worker/gather/tile.h"
#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

// A room of 4 x 3 x 4 m whose cells are lit by hand, as some photons might have, and texels on its floor.
class Spots : public testing::Test {
 protected:
  static constexpr float kDim = 1, kBright = 300, kAlbedo = 0.5f;

  static Scene Room() {
    SceneBuilder builder({16, 16});
    builder.AddRoom({0, 0, 0}, {4, 3, 4}, {.lightmapped = false});
    builder.AddQuad({0.5, 0.01, 0.5}, {0, 0, 3}, {3, 0, 0}, {.page = {0, 0, 16, 16}});
    builder.AddPointLight({2, 2.9, 2}, {1e-9f, 1e-9f, 1e-9f});
    return builder.Build();
  }

  // kBright where `lit` says so, kDim elsewhere.
  template <typename Lit>
  void Light(Lit lit) {
    cache_.light.assign(2 * cells_.cells().size(), {});
    for (size_t c = 0; c < cells_.cells().size(); ++c) {
      const float irradiance = lit(InRoom(cells_.cells()[c].position)) ? kBright : kDim;
      cache_.light[2 * c].irradiance = {irradiance, irradiance, irradiance};
    }
  }
  Vec3f InRoom(Vec3f position) const { return position + ToFloat(scene_.origin_ws); }
  // A square metre of the wall at x = 0, rounded to cells.
  static bool InPatch(Vec3f p) { return p.x < 0.01f && std::fabs(p.y - 1.5f) < 0.5f && std::fabs(p.z - 2) < 0.5f; }

  GatherScene Gathered(const BrightnessPyramid* pyramid) const {
    return {*prepared_.world, *prepared_.lights, tree_, cells_, cache_, pyramid};
  }
  TileSpots SpotsOf(const BrightnessPyramid& pyramid, float expected) {
    return TileSpots(Gathered(&pyramid), pyramid, prepared_.texels, prepared_.texels.texels, expected, 1, counters_);
  }

  const Scene scene_ = Room();
  const PreparedLevel prepared_ = PrepareInMemory(scene_, {});
  const LightTree tree_{*prepared_.lights};
  const SurfaceCells cells_ = SurfaceCells::Build(*prepared_.world, 3000);
  RadianceCache cache_;
  GatherCounters counters_;
};

TEST_F(Spots, SquaresAddUpToTheirPatches) {
  Light(InPatch);
  const BrightnessPyramid pyramid(cells_, cache_);
  double flux = 0, wanted = 0;
  for (size_t i = 0; i < cache_.light.size(); ++i) {
    wanted += static_cast<double>(cache_.light[i].irradiance.x) * static_cast<double>(cells_.cells()[i / 2].area);
  }
  float typical = std::numeric_limits<float>::infinity();
  for (const BrightnessPyramid::Spot& patch : pyramid.patches()) {
    flux += static_cast<double>(patch.light.flux);
    EXPECT_LE(patch.light.Typical(), typical);
    typical = patch.light.Typical();
    std::vector<BrightnessPyramid::Spot> level{patch};
    while (level[0].square.level > 0) {
      std::vector<BrightnessPyramid::Spot> finer;
      for (const BrightnessPyramid::Spot& spot : level) {
        const size_t begin = finer.size();
        pyramid.Split(spot.square, finer);
        float parts = 0, squares = 0, area = 0;
        for (size_t i = begin; i < finer.size(); ++i) {
          parts += finer[i].light.flux;
          squares += finer[i].light.square;
          area += finer[i].place.area;
        }
        EXPECT_NEAR(parts, spot.light.flux, 1e-5f * spot.light.flux);
        EXPECT_NEAR(squares, spot.light.square, 1e-5f * spot.light.square);
        EXPECT_NEAR(area, spot.place.area, 1e-4f * spot.place.area);
      }
      level = finer;
    }
  }
  EXPECT_NEAR(flux, wanted, 1e-5 * wanted);
}

TEST_F(Spots, ThePatchesWithTheMostLightAreLookedAt) {
  Light(InPatch);
  const BrightnessPyramid all(cells_, cache_), two(cells_, cache_, 2);
  ASSERT_GT(all.patches().size(), 2u);
  ASSERT_EQ(two.patches().size(), 2u);
  float least = std::numeric_limits<float>::infinity();
  for (const BrightnessPyramid::Spot& patch : two.patches()) least = std::min(least, patch.light.square);
  int above = 0;
  for (const BrightnessPyramid::Spot& patch : all.patches()) above += patch.light.square > least ? 1 : 0;
  EXPECT_LT(above, 2);
  EXPECT_FALSE(SpotsOf(two, kDim).empty());
}

TEST_F(Spots, APointIsHeldByOneSquareOfALevelAndLiesInIt) {
  Light(InPatch);
  const BrightnessPyramid pyramid(cells_, cache_);
  TestRandom random(3);
  int held = 0;
  for (int k = 0; k < 200; ++k) {
    const auto triangle =
        static_cast<uint32_t>(random.Unit() * static_cast<float>(prepared_.world->triangles().size()));
    const Vec3f at = prepared_.world->PointAt(triangle, 0.5f * random.Unit(), 0.5f * random.Unit(), false).position;
    for (const BrightnessPyramid::Spot& patch : pyramid.patches()) {
      std::vector<BrightnessPyramid::Spot> parts;
      if (patch.square.level > 0) pyramid.Split(patch.square, parts);
      int here = 0;
      for (const BrightnessPyramid::Spot& part : parts) {
        if (!pyramid.Holds(part.square, triangle, at)) continue;
        ++here;
        const Vec3f d = at - part.place.center;
        EXPECT_NEAR(Dot(d, part.place.normal), 0, 1e-5f);
        EXPECT_LE(std::fabs(Dot(d, part.place.u)), 1.001f * Dot(part.place.u, part.place.u));
        EXPECT_LE(std::fabs(Dot(d, part.place.v)), 1.001f * Dot(part.place.v, part.place.v));
      }
      EXPECT_EQ(here, !parts.empty() && pyramid.Holds(patch.square, triangle, at) ? 1 : 0);
      held += here;
    }
  }
  EXPECT_EQ(held, 200);
}

// Rays that are drawn go where the density says, as often as it says: the mean of 1 / density over them is the solid
// angle that it covers, and the density's own integral is 1.
TEST_F(Spots, AimsAsItsDensitySays) {
  Light(InPatch);
  const BrightnessPyramid pyramid(cells_, cache_);
  const TileSpots spots = SpotsOf(pyramid, kDim);
  ASSERT_FALSE(spots.empty());
  for (const size_t i : {size_t{0}, size_t{100}, size_t{255}}) {
    const Texel& texel = prepared_.texels.texels[i];
    const TileSpots::Choice choice = spots.ForTexel(texel);
    ASSERT_GT(choice.share, 0.1f);
    const SobolSet set(static_cast<uint32_t>(i));
    constexpr uint32_t kRays = 1 << 19;
    double integral = 0, covered = 0, angle = 0;
    for (uint32_t k = 0; k < kRays; ++k) {
      const SobolPoint u = set.At(k);
      const Vec3f dir = UniformSphere(u.Get2(0));
      const auto density = static_cast<double>(spots.Density(choice, texel.position, dir));
      integral += density * 4 * kPi / kRays;
      covered += (density > 0 ? 4 * kPi : 0) / kRays;
      const Vec3f aimed = NormalizeOrZero(spots.Draw(choice, u.Get2(2)) - texel.position);
      angle += 1 / static_cast<double>(spots.Density(choice, texel.position, aimed)) / kRays;
      const Vec3f from = InRoom(texel.position), at = from - aimed * (from.x / aimed.x);
      ASSERT_TRUE(std::fabs(at.y - 1.5f) < 0.75f && std::fabs(at.z - 2) < 0.75f) << at.y << " " << at.z;
    }
    EXPECT_NEAR(integral, 1, 0.02);
    EXPECT_NEAR(angle / covered, 1, 0.02);
  }
}

TEST_F(Spots, NobodyAimsWhereAllIsAlikeOrHidden) {
  Light([](Vec3f) { return true; });
  EXPECT_TRUE(SpotsOf(BrightnessPyramid(cells_, cache_), kBright).empty());
  // On the far sides of the walls, which no texel sees.
  for (size_t c = 0; c < cells_.cells().size(); ++c) {
    std::swap(cache_.light[2 * c].irradiance, cache_.light[2 * c + 1].irradiance);
  }
  EXPECT_TRUE(SpotsOf(BrightnessPyramid(cells_, cache_), kDim).empty());
}

// As where cells are so small that no float holds what photons bring to them.
TEST_F(Spots, BrightnessBeyondNumbersIsAimedAtAsAnyOther) {
  Light(InPatch);
  for (CachedLight& light : cache_.light) {
    if (light.irradiance.x == kBright) light.irradiance = Rgb{1, 1, 1} * std::numeric_limits<float>::infinity();
  }
  cache_.light[0].irradiance = Rgb{1, 1, 1} * std::numeric_limits<float>::quiet_NaN();
  const BrightnessPyramid pyramid(cells_, cache_);
  const TileSpots spots = SpotsOf(pyramid, kDim);
  ASSERT_FALSE(spots.empty());
  const Texel& texel = prepared_.texels.texels[100];
  const TileSpots::Choice choice = spots.ForTexel(texel);
  EXPECT_NEAR(choice.share, 0.4f, 1e-6f);
  const Vec3f dir = NormalizeOrZero(spots.Draw(choice, {0.5f, 0.5f}) - texel.position);
  EXPECT_GT(spots.Density(choice, texel.position, dir), 0);
  EXPECT_LT(spots.Density(choice, texel.position, dir), 1e6f);
}

// With gather rays aimed and without: the irradiance of a closed room of one radiance, and of a brighter square of its
// wall (its form factor, cell by cell), with a tenth of the variance.
TEST_F(Spots, BringTheSameLightWithLessNoise) {
  Light(InPatch);
  GatherOptions options;
  options.min_samples = options.max_samples = options.worst_samples = options.mean_samples = 64;
  options.mean_irradiance = kDim;
  options.filter = false;
  const BrightnessPyramid pyramid(cells_, cache_);
  std::array<double, 2> variance{};
  for (const bool aimed : {false, true}) {
    double mean = 0, wanted = 0;
    const auto lights =
        GatherTile(Gathered(aimed ? &pyramid : nullptr), prepared_.layout, prepared_.texels, 0, options, counters_);
    ASSERT_EQ(lights.size(), prepared_.texels.texels.size());
    for (size_t i = 0; i < lights.size(); ++i) {
      mean += static_cast<double>(Luminance(lights[i].indirect.irradiance));
      variance[aimed ? 1 : 0] += LuminanceVariance(lights[i].indirect.variance);
      wanted += static_cast<double>(kAlbedo * kDim);
      for (const SurfaceCell& cell : cells_.cells()) {
        if (!InPatch(InRoom(cell.position))) continue;
        const Vec3d d = ToDouble(cell.position - prepared_.texels.texels[i].position);
        const double square = Dot(d, d);
        wanted += static_cast<double>(kAlbedo * (kBright - kDim) * cell.area) * std::fabs(d.x * d.y) /
                  (kPi * square * square);
      }
    }
    EXPECT_NEAR(mean / wanted, 1, 0.02) << aimed;
  }
  EXPECT_LT(variance[1], 0.1 * variance[0]);
}

}  // namespace
}  // namespace bakewell
