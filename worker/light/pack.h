#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace bakewell {

// The points within `radius` [m] of `position` on a plane with unit `normal` (zero: any), which want light.
struct LitPlace {
  Vec3f position, normal;
  float radius = 0;
};

// What is asked of a light, or of several together, to choose among many: a sphere that holds them, the directions that
// they emit to, and how brightly.
struct LightShape {
  Vec3f center;
  float radius = 0;        // [m]
  Vec3f axis{0, 0, 1};     // unit, of the cone of emission
  float cone_rad = kPiF;   // its half angle, falloff included; pi: to everywhere
  bool two_sided = false;  // the cone opens along -axis as well
  float intensity = 0;     // luminance, of all together along their brightest directions [W sr^-1]
  float softness = 0;      // added to the square of the distance [m^2]
  // At the cosine x to the axis it emits clamp(scale x + offset, least, 1) of its intensity, or the square of that.
  float scale = 0, offset = 1, least = 1;
  bool squared = false;
};

// Shapes side by side, so that many are weighed at once.
class LightPack {
 public:
  static constexpr size_t kMost = 256;  // shapes that are weighed together
  static constexpr size_t kLanes = 8;
  struct Weights {
    alignas(32) std::array<float, kMost> of;
    std::array<float, kLanes> lane{};  // sums of every eighth
    float total = 0;
  };

  LightPack() = default;
  explicit LightPack(std::span<const LightShape> shapes);
  size_t size() const { return size_; }

  // About the unoccluded irradiance (luminance) that each of shapes [begin, end), at most kMost, brings to a place: 0
  // only where it brings none.
  void Weigh(const LitPlace& place, size_t begin, size_t end, Weights& weights) const;

 private:
  enum Column : size_t {
    kX,
    kY,
    kZ,
    kRadius,
    kAxisX,
    kAxisY,
    kAxisZ,
    kCosCone,
    kSinCone,
    kBack,
    kIntensity,
    kSoftness,
    kScale,
    kOffset,
    kLeast,
    kSquared,
    kColumns
  };

  size_t size_ = 0;
  std::array<std::vector<float>, kColumns> column_;  // size_ + kLanes each, the last ones black
};

// One of the weights, each as likely as it is large; u in [0, 1).
struct DrawnWeight {
  int index = -1;  // -1: there is none
  float probability = 0;
  float remainder = 0;  // u within the weight, uniform in [0, 1) again
};
DrawnWeight DrawWeight(const LightPack::Weights& weights, size_t count, float u);

}  // namespace bakewell
