#include "worker/light/pack.h"

#include <immintrin.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace bakewell {
namespace {

constexpr float kSlack = 1e-4f;        // of cosines
constexpr float kLeastCosine = 0.01f;  // at the receiver, of what is in front of it
constexpr float kLargest = 1e30f;      // weight; kMost of them have a sum
constexpr float kTiny = 1e-30f;

using Lanes = __m256;  // eight floats; + - * / and comparisons are GCC's

constexpr Lanes kLane{0, 1, 2, 3, 4, 5, 6, 7};

Lanes All(float x) { return _mm256_set1_ps(x); }
Lanes Least(Lanes a, Lanes b) { return _mm256_min_ps(a, b); }
Lanes Most(Lanes a, Lanes b) { return _mm256_max_ps(a, b); }
Lanes Sqrt(Lanes a) { return _mm256_sqrt_ps(a); }

}  // namespace

LightPack::LightPack(std::span<const LightShape> shapes) : size_(shapes.size()) {
  for (std::vector<float>& column : column_) column.assign(size_ + kLanes, 0);
  for (size_t i = 0; i < size_; ++i) {
    const LightShape& shape = shapes[i];
    const auto set = [&](Column column, float value) { column_[column][i] = value; };
    set(kX, shape.center.x);
    set(kY, shape.center.y);
    set(kZ, shape.center.z);
    set(kRadius, shape.radius);
    set(kAxisX, shape.axis.x);
    set(kAxisY, shape.axis.y);
    set(kAxisZ, shape.axis.z);
    set(kCosCone, std::cos(shape.cone_rad));
    set(kSinCone, std::sin(shape.cone_rad));
    set(kBack, shape.two_sided ? -1.0f : 1.0f);
    set(kIntensity, shape.intensity);
    set(kSoftness, shape.softness);
    set(kScale, shape.scale);
    set(kOffset, shape.offset);
    set(kLeast, shape.least);
    set(kSquared, shape.squared ? 1.0f : 0.0f);
  }
}

void LightPack::Weigh(const LitPlace& place, size_t begin, size_t end, Weights& weights) const {
  const size_t count = end - begin;
  BAKEWELL_CHECK(count <= kMost && end <= size_);
  const auto at = [&](Column column, size_t i) { return _mm256_loadu_ps(column_[column].data() + begin + i); };
  const bool any_way = Dot(place.normal, place.normal) < 0.5f;
  const Lanes zero = All(0), one = All(1), around = All(place.radius), rise = All(any_way ? kLargest : place.radius);
  const Lanes around2 = All(place.radius * place.radius + kTiny);
  const Vec3f n = place.normal;
  Lanes sums = zero;
  for (size_t i = 0; i < count; i += kLanes) {
    const Lanes dx = at(kX, i) - All(place.position.x), dy = at(kY, i) - All(place.position.y),
                dz = at(kZ, i) - All(place.position.z), radius = at(kRadius, i);
    const Lanes distance2 = dx * dx + dy * dy + dz * dz, inverse = one / Sqrt(distance2 + All(kTiny));
    const Lanes height = dx * All(n.x) + dy * All(n.y) + dz * All(n.z) + radius + rise;
    const Lanes cosine = Least(Most(height * inverse, All(kLeastCosine)), one);
    // Cosine at the light, and the least of its cone widened by the angle under which the spheres are seen.
    const Lanes ahead = -(dx * at(kAxisX, i) + dy * at(kAxisY, i) + dz * at(kAxisZ, i)) * inverse;
    const Lanes along = Most(ahead, at(kBack, i) * ahead);
    const Lanes sine = Least((radius + around) * inverse, one), wide = Sqrt(one - sine * sine);
    const Lanes cos_cone = at(kCosCone, i), sin_cone = at(kSinCone, i);
    const Lanes edge = cos_cone * wide - sin_cone * sine - All(kSlack);
    const auto everywhere = (sine >= one) | (sin_cone * wide + cos_cone * sine <= zero);
    const Lanes lobe = Least(Most(at(kScale, i) * (along + around * inverse) + at(kOffset, i), at(kLeast, i)), one);
    const Lanes shaped = lobe * (one + at(kSquared, i) * (lobe - one));
    const Lanes fall = distance2 + at(kSoftness, i) + around2;
    const Lanes weight = Least(at(kIntensity, i) * cosine * shaped / fall, All(kLargest));
    const Lanes left = All(static_cast<float>(count - i));
    const Lanes reached = (height > zero) & (everywhere | (along > edge)) & (kLane < left) ? weight : zero;
    _mm256_store_ps(weights.of.data() + i, reached);
    sums += reached;
  }
  weights.total = 0;
  for (size_t lane = 0; lane < kLanes; ++lane) {
    weights.lane[lane] = sums[lane];
    weights.total += sums[lane];
  }
}

DrawnWeight DrawWeight(const LightPack::Weights& weights, size_t count, float u) {
  DrawnWeight drawn;
  if (!(weights.total > 0)) return drawn;
  float rest = u * weights.total;
  // Rounding may leave more than there is: then it is the last that has any.
  size_t lane = 0;
  for (size_t i = 0; i < LightPack::kLanes; ++i) {
    if (!(weights.lane[i] > 0)) continue;
    lane = i;
    if (rest < weights.lane[i]) break;
    rest -= weights.lane[i];
  }
  for (size_t i = lane; i < count; i += LightPack::kLanes) {
    const float weight = weights.of[i];
    if (!(weight > 0)) continue;
    drawn = {static_cast<int>(i), weight / weights.total, std::clamp(rest / weight, 0.0f, 0x1.fffffep-1f)};
    if (rest < weight) break;
    rest -= weight;
  }
  return drawn;
}

}  // namespace bakewell
