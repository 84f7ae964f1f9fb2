#pragma once

#include <string>

#include "tests/support/bake_scene.h"
#include "tests/support/scene_builder.h"

namespace bakewell {

// Every texel gets the same number of samples; a fixed number of photons; no filter.
BakeSettings StressSettings(int samples, int64_t photons);

// Bakes and expects of every number that is written to disk that it is finite, of every irradiance that it is not
// negative, and of every sample that it was good.
BakedScene BakeStress(const Scene& scene, const BakeSettings& settings);

// What a bake's texels (of one object, or of all) say against a closed form.
struct Deviation {
  double worst = 0;       // largest |E / expected - 1|
  double mean_ratio = 0;  // mean E over mean expected
  double brightest = 0;   // largest E
  int texels = 0;
};

// `expected(position_ws, normal)` is the irradiance [W m^-2] of the red channel. `channel` picks another one.
// `object` is the number of one of the scene's objects; -1: all.
template <typename Expected>
Deviation Compare(const BakedScene& baked, Expected expected, int object = -1, int channel = 0) {
  Deviation result;
  double sum = 0, expected_sum = 0;
  const World& world = *baked.prepared.world;
  for (size_t i = 0; i < baked.texels().size(); ++i) {
    const Texel& texel = baked.texels()[i];
    const uint32_t triangle = baked.prepared.texels.fragments[texel.fragment_begin].triangle;
    if (object >= 0 && world.triangles()[triangle].object != static_cast<uint32_t>(object)) continue;
    const Vec3d position = ToDouble(texel.position) + world.scene().origin_ws;
    const double right = expected(position, ToDouble(texel.normal));
    const double value = static_cast<double>(baked.lights()[i].irradiance[channel]);
    result.worst = std::max(result.worst, std::fabs(value / right - 1));
    result.brightest = std::max(result.brightest, value);
    sum += value;
    expected_sum += right;
    ++result.texels;
  }
  result.mean_ratio = sum / expected_sum;
  return result;
}

// A rotation that no grid lines up with.
Vec3d Askew(Vec3d v);

}  // namespace bakewell
