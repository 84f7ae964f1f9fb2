#include "worker/filter/connect.h"

#include <algorithm>
#include <cmath>

#include "worker/filter/connections.h"

namespace bakewell {
namespace {

constexpr float kLift = 0.05f;  // height of the rays between neighbours, over their length
// Of neighbours one of which has so many times less room above it one lies in a gap and the other outside, in other
// light. What is more than kMostRoom texels away makes no gap; so the other of the two is crowded as well. No whole
// ratio: levels are built on the grid that texels lie on, and rounding would decide.
constexpr float kSameRoom = 2.1f, kMostRoom = 2;

// A little off the texel's centre, for the same reason: a ray along a wall meets it or does not.
constexpr float kAside = 0.07f;

// How far the surface is that a texel faces, in sides of a texel; `sides` is the way to a neighbour.
float RoomAbove(const World& world, const Texel& texel, Vec3f to_neighbour, float sides, int64_t& rays) {
  const float side = Length(to_neighbour) / sides, lift = kLift * side;
  ++rays;
  const Vec3f from = texel.position + to_neighbour * kAside + texel.normal * lift;
  const Hit hit = world.Intersect({from, texel.normal, kMostRoom * side, 0});
  return hit ? (hit.t + lift) / side : kMostRoom;
}

}  // namespace

bool LiesOpen(const World& world, const Texel& a, const Texel& b, float sides, int64_t& rays) {
  const float lift = kLift * Length(b.position - a.position);
  const Vec3f from = a.position + a.normal * lift, way = b.position + b.normal * lift - from;
  const float length = Length(way);
  if (!(length > 0)) return true;
  ++rays;
  if (world.Occluded({from, way / length, length, 0})) return false;
  const float room_a = RoomAbove(world, a, b.position - a.position, sides, rays);
  const float room_b = RoomAbove(world, b, a.position - b.position, sides, rays);
  return std::max(room_a, room_b) <= kSameRoom * std::min(room_a, room_b);
}

uint8_t ConnectTexel(const World& world, const TexelMap& map, uint32_t texel, bool crowded, int64_t& rays) {
  const Texel& a = map.texels[texel];
  const PageSize page = map.pages[a.page];
  uint8_t open = 0;
  for (size_t k = 0; k < 4; ++k) {
    const int x = a.x + kNeighbours[k][0], y = a.y + kNeighbours[k][1];
    if (x < 0 || y < 0 || x >= page.width || y >= page.height) continue;
    const int32_t other =
        map.texel_at[a.page][static_cast<size_t>(y) * static_cast<size_t>(page.width) + static_cast<size_t>(x)];
    if (other < 0) continue;
    const Texel& b = map.texels[other];
    if (a.chart != b.chart || Dot(a.normal, b.normal) < kSameFacing) continue;
    const float sides = std::hypot(static_cast<float>(kNeighbours[k][0]), static_cast<float>(kNeighbours[k][1]));
    if (crowded && !LiesOpen(world, a, b, sides, rays)) continue;
    open |= static_cast<uint8_t>(1U << k);
  }
  return open;
}

}  // namespace bakewell
