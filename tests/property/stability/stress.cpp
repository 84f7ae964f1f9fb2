#include "tests/property/stability/stress.h"

#include <gtest/gtest.h>

#include <cmath>

namespace bakewell {

BakeSettings StressSettings(int samples, int64_t photons) {
  BakeSettings settings;
  settings.min_samples = settings.max_samples = samples;
  settings.photons = photons;
  settings.filter = false;
  return settings;
}

BakedScene BakeStress(const Scene& scene, const BakeSettings& settings) {
  BakedScene baked = BakeSceneInMemory(scene, settings);
  int bad = 0, negative = 0;
  for (const TexelLight& light : baked.lights()) {
    bool finite = IsFinite(light.irradiance) && IsFinite(light.variance) && std::isfinite(light.backface_share);
    for (const Rgb& lambda : light.sh.lambda) finite = finite && IsFinite(lambda);
    bad += finite ? 0 : 1;
    const float least = std::min({light.irradiance.x, light.irradiance.y, light.irradiance.z});
    negative += least < 0 ? 1 : 0;
  }
  EXPECT_GT(baked.lights().size(), 0u);
  EXPECT_EQ(bad, 0) << "texels with a NaN or an infinity";
  EXPECT_EQ(negative, 0) << "texels with negative light";
  EXPECT_EQ(baked.baked.counters.bad_samples, 0);
  return baked;
}

Vec3d Askew(Vec3d v) {
  // Three turns about x, y and z.
  constexpr double kX = 0.37, kY = 1.13, kZ = -0.71;
  v = {v.x, std::cos(kX) * v.y - std::sin(kX) * v.z, std::sin(kX) * v.y + std::cos(kX) * v.z};
  v = {std::cos(kY) * v.x + std::sin(kY) * v.z, v.y, -std::sin(kY) * v.x + std::cos(kY) * v.z};
  return {std::cos(kZ) * v.x - std::sin(kZ) * v.y, std::sin(kZ) * v.x + std::cos(kZ) * v.y, v.z};
}

}  // namespace bakewell
