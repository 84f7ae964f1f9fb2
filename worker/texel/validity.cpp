#include "worker/texel/validity.h"

#include <absl/container/inlined_vector.h>

#include <algorithm>
#include <limits>

#include "worker/sample/sobol.h"
#include "worker/sample/warp.h"

namespace bakewell {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kInsideShare = 0.9f;    // of back faces: the texel is inside as a whole, if nothing divides it
constexpr float kOutsideShare = 0.25f;  // of back faces: the texel is outside as a whole, if nothing divides it
constexpr int kValidityFirstRays = 8;   // of a texel that something may divide
constexpr int kCrowdRays = 8, kPlaceRays = 3, kInsideRays = 16, kPlaces = 16;
constexpr int kSureRays = 4;  // that met nothing but back faces

// Cosine-weighted rays from one place, and how many of them met a back face first.
struct Backs {
  int rays = 0, backs = 0;
  float Share() const { return static_cast<float>(backs) / static_cast<float>(rays); }
};
void AddRays(const World& world, const SurfacePoint& from, const Frame& frame, const SobolSet& set, int end,
             Backs& seen, int& rays) {
  for (; seen.rays < end; ++seen.rays, ++rays) {
    const Vec3f dir = frame.ToWorld(CosineHemisphere(set.At(static_cast<uint32_t>(seen.rays)).Get2(0)));
    seen.backs += MeetsBack(world, world.Intersect(RayFrom(from, dir, kInfinity, set.key()))) ? 1 : 0;
  }
}

float BackShare(const World& world, const SurfacePoint& from, const Frame& frame, const SobolSet& set, int count,
                int& rays) {
  Backs seen;
  AddRays(world, from, frame, set, count, seen, rays);
  return seen.Share();
}

// Whether more than half of kInsideRays meet a back face: `seen` goes on until that is certain, or as good as that.
bool IsInside(const World& world, const SurfacePoint& from, const Frame& frame, const SobolSet& set, Backs& seen,
              int& rays) {
  while (2 * seen.backs <= kInsideRays && 2 * (seen.rays - seen.backs) < kInsideRays) {
    if (seen.backs == seen.rays && seen.rays >= kSureRays) return true;
    AddRays(world, from, frame, set, seen.rays + 1, seen, rays);
  }
  return 2 * seen.backs > kInsideRays;
}

// The four directions along the surface in which a texel looks for walls.
std::array<Vec3f, 4> Tangents(const Frame& frame) { return {frame.t, -frame.t, frame.b, -frame.b}; }

// Something within the texel's own reach: a wall that stands on it, a box that covers part of it.
bool Crowded(const World& world, const TexelPoint& center, float radius, int& rays) {
  const Frame& frame = center.frame;
  for (const Vec3f dir : Tangents(frame)) {
    const Vec3f between = NormalizeOrZero(dir + Cross(frame.n, dir));
    rays += 2;
    if (world.Intersect(RayFrom(center.surface, dir, radius, 0))) return true;
    if (world.Intersect(RayFrom(center.surface, between, radius, 0))) return true;
  }
  return false;
}

uint16_t ProbeMask(const World& world, const TexelSampler& sampler, const SobolSet& set, TexelValidity& result) {
  uint16_t tested = 0, valid = 0;
  float backs = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const Vec2f u{(static_cast<float>(i % 4) + 0.5f) / 4, (static_cast<float>(i / 4) + 0.5f) / 4};
    const TexelPoint point = sampler.At(u);
    Backs seen;
    AddRays(world, point.surface, point.frame, set, kPlaceRays, seen, result.rays);
    const bool inside = seen.backs > 0 && IsInside(world, point.surface, point.frame, set, seen, result.rays);
    backs += seen.Share();
    const uint16_t bit = static_cast<uint16_t>(1U << sampler.BitAt(u));
    tested |= bit;
    if (!inside) valid |= bit;
  }
  result.backface_share = backs / kPlaces;
  if (valid == 0) return 0;
  return static_cast<uint16_t>(valid | static_cast<uint16_t>(~tested));
}

// A place past the nearest back face within one texel diagonal that is outside, if there is one.
bool PushOut(const World& world, TexelSampler& sampler, const SobolSet& set, TexelValidity& result) {
  const TexelPoint center = sampler.At({0.5f, 0.5f});
  const float reach = 2 * sampler.radius();
  for (const Vec3f dir : Tangents(center.frame)) {
    ++result.rays;
    const Hit hit = world.Intersect(RayFrom(center.surface, dir, reach, 0));
    if (!MeetsBack(world, hit)) continue;
    SurfacePoint moved = center.surface;
    moved.position += dir * (hit.t * 1.001f + 4 * moved.offset);
    Backs seen;
    if (IsInside(world, moved, center.frame, set, seen, result.rays)) continue;
    sampler.MoveTo(moved.position);
    return true;
  }
  return false;
}

TexelValidity Saving(int rays, TexelValidity result) {
  result.rays_saved = rays;
  return result;
}

// A texel that nothing else divides is inside or outside as its centre is.
TexelValidity ProbeWhole(const World& world, TexelSampler& sampler, const SobolSet& set, TexelValidity result) {
  const TexelPoint center = sampler.At({0.5f, 0.5f});
  result.backface_share = BackShare(world, center.surface, center.frame, set, kInsideRays, result.rays);
  if (result.backface_share > 0.5f) {
    result.pushed_out = PushOut(world, sampler, set, result);
    result.valid = result.pushed_out;
  }
  return result;
}

// The texel's plane: heights above it, and places on it about the texel's centre.
struct Plane {
  Vec3f origin;
  Frame frame;
  Vec3d Of(Vec3f p) const {
    const Vec3d d = ToDouble(p) - ToDouble(origin);
    return {Dot(d, ToDouble(frame.t)), Dot(d, ToDouble(frame.b)), Dot(d, ToDouble(frame.n))};
  }
};

// The part of a polygon where sign * (height - limit) >= 0.
absl::InlinedVector<Vec3d, 8> ClipHeight(const absl::InlinedVector<Vec3d, 8>& polygon, double limit, double sign) {
  absl::InlinedVector<Vec3d, 8> part;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Vec3d a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a.z - limit), db = sign * (b.z - limit);
    if (da >= 0) part.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) part.push_back(a + (b - a) * (da / (da - db)));
  }
  return part;
}

// Whether a triangle comes within `radius` of the centre, seen along the normal, at heights in [low, high].
bool StandsWithin(const Plane& plane, const Triangle& t, double low, double high, double radius) {
  absl::InlinedVector<Vec3d, 8> part{plane.Of(t.p0), plane.Of(t.p0 + t.e1), plane.Of(t.p0 + t.e2)};
  part = ClipHeight(ClipHeight(part, low, 1), high, -1);
  int left = 0, right = 0;  // of the edges, the centre
  for (size_t i = 0; i < part.size(); ++i) {
    Vec3d a = part[i], along = part[(i + 1) % part.size()] - a;
    a.z = along.z = 0;
    const double length2 = Dot(along, along);
    const Vec3d nearest = a + along * (length2 > 0 ? std::clamp(-Dot(a, along) / length2, 0.0, 1.0) : 0.0);
    if (Dot(nearest, nearest) <= radius * radius) return true;
    const double side = Cross(a, along).z;
    left += side > 0 ? 1 : 0;
    right += side < 0 ? 1 : 0;
  }
  return left + right > 0 && (left == 0 || right == 0);
}

}  // namespace

Surroundings LookAround(const World& world, const AtlasLayout& layout, const Texel& texel, const TexelSampler& sampler,
                        float footprint) {
  constexpr float kAboutFlat = 0.9f;  // cosine
  constexpr int kMostVisited = 64;
  const Plane plane{texel.position, FrameFromNormal(texel.normal)};
  const float radius = sampler.radius();
  Surroundings around{false, false};
  int visited = 0;
  world.VisitNear(texel.position, 2 * radius, [&](uint32_t triangle) {
    const Triangle& t = world.triangles()[triangle];
    const std::vector<int32_t>& charts = layout.objects[t.object].chart_of_triangle;
    const bool own = !charts.empty() && charts[t.index_in_object] == texel.chart;
    const auto height = [&](Vec3f p) { return Dot(p - texel.position, texel.normal); };
    const float rise = std::max({height(t.p0), height(t.p0 + t.e1), height(t.p0 + t.e2)});
    const float rounding = 4 * world.PointAt(triangle, 0, 0, false).offset;
    if (rise > rounding && !(own && Dot(t.normal, texel.normal) >= kAboutFlat)) {
      around.crowded = true;
      around.divided = !own && !world.MaterialOf(t).double_sided && sampler.LeastHeight(t.p0, t.normal) < -rounding &&
                       StandsWithin(plane, t, -rounding, radius, footprint * radius);
    }
    if (++visited > kMostVisited) around.crowded = true;
    return !around.divided && visited <= kMostVisited;
  });
  return around;
}

bool MeetsBack(const World& world, const Hit& hit) {
  return hit && hit.back && !world.MaterialOf(world.triangles()[hit.triangle]).double_sided;
}

TexelValidity ProbeValidity(const World& world, const Texel& texel, const std::optional<BacksSeen>& seen,
                            PartSearch search, Surroundings around, TexelSampler& sampler) {
  TexelValidity result;
  if (world.backfaces() == BackfaceMode::kPass) return result;
  const SobolSet set(
      HashCombine(HashCombine(static_cast<uint32_t>(texel.x), static_cast<uint32_t>(texel.y)), 0x7a11du));
  const TexelPoint center = sampler.At({0.5f, 0.5f});
  result.backface_share = seen ? seen->share
                               : BackShare(world, center.surface, center.frame, set,
                                           around.crowded ? kValidityFirstRays : kLeastValidityRays, result.rays);
  const auto whole = [&] { return ProbeWhole(world, sampler, set, result); };
  if (search == PartSearch::kNear && !around.divided) {
    constexpr int kParts = kPlaces * kPlaceRays, kOtherParts = kParts - kPlaceRays;  // rays, at least
    if (result.backface_share == 0) return Saving(around.crowded ? kCrowdRays : 0, result);
    const bool outside = seen && result.backface_share <= kOutsideShare && seen->nearest > 2 * sampler.radius();
    const bool inside = result.backface_share > kInsideShare;
    if (!around.crowded) {
      return outside && seen->rays >= kValidityFirstRays ? Saving(kInsideRays, result) : whole();
    }
    if ((outside || inside) && !Crowded(world, center, sampler.radius(), result.rays)) {
      return outside ? Saving(kParts, result) : Saving(kOtherParts, whole());
    }
  } else if (!around.crowded) {
    return result.backface_share == 0 ? result : whole();
  } else if (!around.divided && result.backface_share == 0 && !Crowded(world, center, sampler.radius(), result.rays)) {
    return result;
  }
  const uint16_t mask = ProbeMask(world, sampler, set, result);
  if (mask != 0) {
    sampler.set_valid_mask(mask);
    return result;
  }
  result.pushed_out = PushOut(world, sampler, set, result);
  result.valid = result.pushed_out;
  return result;
}

}  // namespace bakewell
