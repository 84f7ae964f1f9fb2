#include "tests/property/studio.h"

#include <cmath>

namespace bakewell {

Vec3d Placement::Direction(Vec3d d) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {c * d.x + s * d.z, d.y, -s * d.x + c * d.z};
}

namespace {

// Adds the studio's parts under a placement.
class StudioBuilder {
 public:
  explicit StudioBuilder(const Placement& at) : at_(at), builder_({kStudioPage, kStudioPage}) {}

  void AddShell() {
    const int white = builder_.AddMaterial(Rgb{0.7f, 0.7f, 0.65f});
    const int red = builder_.AddMaterial(Rgb{0.6f, 0.2f, 0.15f});
    Quad({0, 0, 0}, {0, 0, 5}, {4, 0, 0}, {.material = white, .page = {0, 0, 15, 12}});      // floor, up
    Quad({0, 3, 0}, {4, 0, 0}, {0, 0, 5}, {.material = white, .page = {16, 0, 12, 15}});     // ceiling, down
    Quad({0, 0, 0}, {4, 0, 0}, {0, 3, 0}, {.material = red, .page = {0, 16, 8, 6}});         // z = 0
    Quad({0, 0, 5}, {0, 3, 0}, {4, 0, 0}, {.material = white, .page = {9, 16, 6, 8}});       // z = 5
    Quad({0, 0, 0}, {0, 3, 0}, {0, 0, 5}, {.material = white, .page = {16, 16, 6, 10}});     // x = 0
    Quad({4, 0, 0}, {0, 0, 5}, {0, 1, 0}, {.material = white, .page = {0, 26, 10, 2}});      // x = 4, under the window
    Quad({4, 2.2, 0}, {0, 0, 5}, {0, 0.8, 0}, {.material = white, .page = {0, 29, 10, 2}});  // above
    Quad({4, 1, 0}, {0, 0, 1.5}, {0, 1.2, 0}, {.material = white, .page = {12, 27, 3, 2}});  // beside
    Quad({4, 1, 3.5}, {0, 0, 1.5}, {0, 1.2, 0}, {.material = white, .page = {12, 30, 3, 2}});
  }

  void AddFurniture(bool panel) {
    Material curtain;
    curtain.base_color = {0.4f, 0.5f, 0.3f};
    curtain.base_alpha = 0.4f;
    curtain.alpha_mode = AlphaMode::kBlend;
    Quad({3.6, 0.8, 1.2}, {0, 0, 1.3}, {0, 1.7, 0}, {.material = builder_.AddMaterial(curtain), .lightmapped = false});
    const int lamp = builder_.AddMaterial(Rgb{0, 0, 0}, panel ? Rgb{6, 5, 4} : Rgb{0, 0, 0});
    Quad({0.9, 2.6, 3.1}, {0.8, 0, 0}, {0, 0, 0.6}, {.material = lamp, .lightmapped = false});
    const int grey = builder_.AddMaterial(Rgb{0.5f, 0.5f, 0.55f});
    Quad({1, 0.9, 1}, {0, 0, 1.1}, {1.2, 0, 0}, {.material = grey, .page = {24, 16, 4, 4}});  // a table's top
    Quad({1, 0.85, 1}, {1.2, 0, 0}, {0, 0, 1.1}, {.material = grey, .page = {24, 21, 4, 4}});
  }

  void AddLights(const StudioLights& on) {
    const float k = static_cast<float>(at_.scale * at_.scale);
    if (on.point) builder_.AddPointLight(at_.Point({2.6, 2.1, 3.9}), Rgb{2, 2.5f, 3} * k);
    if (on.spot)
      builder_.AddSpotLight(at_.Point({0.7, 2.7, 0.8}), at_.Direction({0.3, -1, 0.2}), Rgb{6, 6, 5} * k, 0.3, 0.7);
    if (on.sun) builder_.AddDirectionalLight(at_.Direction({-0.8, -0.6, 0.1}), {20, 18, 15}, 0.00925);
    if (!on.sky) return;
    Environment sky;
    sky.type = EnvironmentType::kGradient;
    sky.zenith = {2, 3, 5};
    sky.horizon = {1.5f, 2, 3};
    sky.ground = {0.3f, 0.25f, 0.2f};
    builder_.SetEnvironment(sky);
  }

  // As a loader would, lights bring tangents that turn with them.
  Scene Finish() const {
    Scene scene = builder_.Build();
    for (PunctualLight& light : scene.lights) {
      const Vec3f hint = ToFloat(at_.Direction({0.3, 0.1, 0.9}));
      if (light.type == LightType::kPoint) {
        light.direction = ToFloat(at_.Direction({0, 0, -1}));
        light.tangent = ToFloat(at_.Direction({1, 0, 0}));
      } else {
        light.tangent = NormalizeOrZero(hint - light.direction * Dot(hint, light.direction));
      }
    }
    return scene;
  }

 private:
  void Quad(Vec3d origin, Vec3d u, Vec3d v, const Surface& surface) {
    builder_.AddQuad(at_.Point(origin), at_.Direction(u) * at_.scale, at_.Direction(v) * at_.scale, surface);
  }

  Placement at_;
  SceneBuilder builder_;
};

}  // namespace

Scene Studio(const Placement& placement, const StudioLights& on) {
  StudioBuilder builder(placement);
  builder.AddShell();
  builder.AddFurniture(on.panel);
  builder.AddLights(on);
  return builder.Finish();
}

}  // namespace bakewell
