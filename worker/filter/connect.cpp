#include "worker/filter/connect.h"

#include "worker/filter/window.h"

namespace bakewell {
namespace {

constexpr float kLift = 0.05f;       // height of the rays between neighbours, over their length
constexpr float kSameFacing = 0.9f;  // least cosine between the normals of neighbours

}  // namespace

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
    const float lift = kLift * Length(b.position - a.position);
    const Vec3f from = a.position + a.normal * lift, way = b.position + b.normal * lift - from;
    const float length = Length(way);
    if (crowded && length > 0) {
      ++rays;
      if (world.Occluded({from, way / length, length, 0})) continue;
    }
    open |= static_cast<uint8_t>(1U << k);
  }
  return open;
}

}  // namespace bakewell
