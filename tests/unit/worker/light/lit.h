#pragma once

#include <memory>
#include <utility>

#include "worker/light/lights.h"

namespace bakewell {

// A world and its lights; the scene must stay where it is.
struct Lit {
  explicit Lit(Scene from) : scene(std::move(from)) {
    world = World::Build(scene, BackfaceMode::kReflect, 0.98f).value();
    lights = std::make_unique<LightSet>(*world, scene.environment);
  }
  Lit(const Lit&) = delete;
  Scene scene;
  std::unique_ptr<World> world;
  std::unique_ptr<LightSet> lights;
};

// The hit of a ray from `from` at a point of a triangle.
inline Hit HitAt(const Triangle& t, uint32_t triangle, Vec3f from, Vec3f point) {
  const Vec3d e1 = ToDouble(t.e1), e2 = ToDouble(t.e2), d = ToDouble(point) - ToDouble(t.p0), n = Cross(e1, e2);
  return {.triangle = triangle,
          .t = Length(point - from),
          .u = static_cast<float>(Dot(Cross(d, e2), n) / Dot(n, n)),
          .v = static_cast<float>(Dot(Cross(e1, d), n) / Dot(n, n)),
          .back = Dot(point - from, t.normal) > 0};
}

}  // namespace bakewell
