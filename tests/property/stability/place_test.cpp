#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/scene/canonical.h"
#include "tests/property/stability/stress.h"
#include "tests/property/studio.h"
#include "tests/support/gltf_builder.h"
#include "tests/support/temp_dir.h"

// Levels far away, tiny, huge, mirrored, flattened, or with numbers next to nothing.
namespace bakewell {
namespace {

// Root mean square of the differences to the same studio at the origin, over its mean.
double RmsFromHome(const Placement& placement) {
  const auto bake = [](const Placement& at) {
    Scene scene = Studio(at);
    Canonicalize(scene);
    return BakeStress(scene, StressSettings(64, 50000));
  };
  static const BakedScene home = bake({});
  const BakedScene away = bake(placement);
  EXPECT_EQ(home.lights().size(), away.lights().size());
  double square = 0, sum = 0;
  for (size_t i = 0; i < home.lights().size(); ++i) {
    const double a = static_cast<double>(Luminance(home.lights()[i].irradiance));
    const double d = static_cast<double>(Luminance(away.lights()[i].irradiance)) - a;
    square += d * d;
    sum += a;
  }
  return std::sqrt(square * static_cast<double>(home.lights().size())) / sum;
}

// Scales that are no powers of two round every coordinate anew: a few rays that pass an edge decide otherwise.
constexpr double kRounding = 1e-3;

TEST(Scale, OfAThousandthGivesTheSameLight) { EXPECT_LT(RmsFromHome({.scale = 1e-3}), kRounding); }
TEST(Scale, OfTenThousandGivesTheSameLight) { EXPECT_LT(RmsFromHome({.scale = 1e4}), kRounding); }
TEST(Place, AMillionMetresAwayGivesTheSameLight) {
  EXPECT_LT(RmsFromHome({.offset_m = {1e6, -1e6, 1e6}}), kRounding);
  EXPECT_LT(RmsFromHome({.scale = 1e-3, .offset_m = {1e6 + 0.1, 0, 0}}), 10 * kRounding) << "16 mm per 2^-26 m";
}

// The quad of QuadGltf on a page of 8 x 8 texels, placed by `node`, in front of it a sky of radiance 1 and behind it
// nothing: z > 0 of the mesh is its front.
absl::StatusOr<LoadedLevel> LoadQuad(const nlohmann::json& node) {
  GltfBuilder builder = QuadGltf();
  builder.json["nodes"][0].update(node);
  builder.json["scenes"][0]["extras"] = {{"environment", {{"type", "constant"}, {"radiance", {1, 1, 1}}}},
                                         {"lightmap", {{"width", 8}, {"height", 8}}}};
  const TempDir dir;
  return LoadLevel(builder.Write(dir.path() / "quad.glb"));
}

void ExpectOpenQuad(const nlohmann::json& node, Vec3d front_ws) {
  const auto level = LoadQuad(node);
  ASSERT_TRUE(level.ok()) << level.status().message();
  const BakedScene baked = BakeStress(level->scene, StressSettings(256, 10000));
  EXPECT_LT(Compare(baked, [](Vec3d, Vec3d) { return kPi; }).worst, 2e-3) << node;
  for (const Texel& texel : baked.texels()) EXPECT_GT(Dot(ToDouble(texel.normal), front_ws), 0.999) << node;
}

TEST(Transforms, MirroredOnesKeepTheFront) {
  ExpectOpenQuad({{"scale", {-1, 1, 1}}}, {0, 0, 1});
  ExpectOpenQuad({{"scale", {1, 1, -1}}}, {0, 0, -1});
  ExpectOpenQuad({{"scale", {-1, -2, -3}}}, {0, 0, -1});
}

TEST(Transforms, ThatFlattenAlongTheNormalKeepTheQuad) {
  // Its determinant is zero, its surface is all there.
  ExpectOpenQuad({{"scale", {1, 1, 0}}}, {0, 0, 1});
  ExpectOpenQuad({{"scale", {1e3, 1e-3, 1e-9}}}, {0, 0, 1});
}

TEST(Transforms, ThatLeaveNoAreaAreCountedAndRefused) {
  for (const nlohmann::json& scale :
       {nlohmann::json{0, 1, 1}, nlohmann::json{0, 0, 0}, nlohmann::json{1e-30, 1e-30, 1}}) {
    const auto level = LoadQuad({{"scale", scale}});
    ASSERT_TRUE(level.ok()) << level.status().message();
    ASSERT_EQ(level->geometry.size(), 1u) << scale;
    EXPECT_EQ(level->geometry[0].degenerate, 2) << scale;
    PhaseClock clock;
    SilentProgress progress;
    const auto prepared = PrepareLevel(*level, StressSettings(8, 1000), clock, progress);
    EXPECT_EQ(prepared.status().code(), absl::StatusCode::kInvalidArgument) << scale;
  }
}

TEST(Transforms, ThatAreNotFiniteAreRefused) {
  for (const nlohmann::json& node :
       {nlohmann::json{{"scale", {1e200, 1e200, 1}}}, nlohmann::json{{"rotation", {0, 0, 0, 0}}}}) {
    const auto level = LoadQuad(node);
    EXPECT_EQ(level.status().code(), absl::StatusCode::kInvalidArgument) << node;
    EXPECT_NE(level.status().message().find("quad"), std::string::npos) << level.status().message();
  }
}

TEST(Denormals, InEveryNumberOfASceneGiveLightThatIsFinite) {
  constexpr float kDenormal = 1e-41f;
  SceneBuilder builder({32, 16});
  Material dim;
  dim.base_color = dim.emission = {kDenormal, 0.5f, std::numeric_limits<float>::denorm_min()};
  dim.base_alpha = kDenormal;
  const int material = builder.AddMaterial(dim);
  const int floor =
      builder.AddQuad({0, 0, 0}, {0, 1e-41, 4}, {4, 1e-41, 0}, {.material = material, .page = {0, 0, 16, 16}});
  builder.AddTriangle({0, 1, 0}, {1e-41, 1, 0}, {0, 1, 1e-41}, {.material = material, .page = {16, 0, 8, 8}});
  builder.AddPointLight({1, 1e-41, 1}, {kDenormal, kDenormal, kDenormal});
  builder.AddPointLight({2, 2, 2}, {1, kDenormal, kDenormal});
  builder.AddDirectionalLight({1e-41, -1, 0}, {kDenormal, kDenormal, 1}, 1e-41);
  builder.AddSpotLight({2, 2, 2}, {0, -1, 1e-41}, {kDenormal, 1, 1}, 1e-41, 2e-41);
  builder.SetConstantSky({kDenormal, kDenormal, 1});
  const BakedScene baked = BakeStress(builder.Build(), StressSettings(64, 20000));
  const auto lamp = [](Vec3d p, Vec3d) {
    const Vec3d to = Vec3d{2, 2, 2} - p;
    return to.y / std::pow(Length(to), 3);
  };
  // 4 m over 16 texels seen from 2 m: a texel's mean is its centre's within a percent.
  EXPECT_NEAR(Compare(baked, lamp, floor).mean_ratio, 1, 0.01);
}

}  // namespace
}  // namespace bakewell
