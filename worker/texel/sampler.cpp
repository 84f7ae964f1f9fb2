#include "worker/texel/sampler.h"

#include <cmath>

#include "core/base/check.h"
#include "worker/sample/warp.h"
#include "worker/texel/raster.h"

namespace bakewell {
namespace {

// Affine map from the page to a triangle's plane.
struct PageToWorld {
  Vec3d p0;
  Vec2d corner0;
  Vec3d per_x, per_y;  // [m per texel]
  Vec3d At(Vec2d p) const { return p0 + per_x * (p.x - corner0.x) + per_y * (p.y - corner0.y); }
};

PageToWorld MapOf(const Triangle& t, const std::array<Vec2d, 3>& c) {
  const Vec2d a = c[1] - c[0], b = c[2] - c[0];
  const double det = Cross(a, b);
  PageToWorld map{ToDouble(t.p0), c[0], {}, {}};
  if (det == 0) return map;
  const Vec3d e1 = ToDouble(t.e1), e2 = ToDouble(t.e2);
  map.per_x = (e1 * b.y - e2 * a.y) / det;
  map.per_y = (e2 * a.x - e1 * b.x) / det;
  return map;
}

Vec2f ToUnit(Vec2d p, Vec2d texel) { return {static_cast<float>(p.x - texel.x), static_cast<float>(p.y - texel.y)}; }

}  // namespace

void TexelSampler::AddFragment(const World& world, const AtlasLayout& layout, const TexelFragment& fragment,
                               const Window& window, Vec2d texel) {
  const Triangle& t = world.triangles()[fragment.triangle];
  const auto corners = TexelCorners(world, layout, fragment.triangle);
  const ConvexPolygon polygon = ClipToSquare({3, {corners[0], corners[1], corners[2]}}, window.corner, window.side);
  const double area = std::fabs(polygon.SignedArea());
  if (polygon.count < 3 || area <= 0) return;
  const PageToWorld map = MapOf(t, corners);
  const SurfacePoint point = world.PointAt(fragment.triangle, 0, 0, false);
  sides_.push_back({FrameFromHint(t.normal, ToFloat(NormalizeOrZero(map.per_x))), point.offset});
  radius_ = std::max(radius_,
                     static_cast<float>(0.5 * std::max(Length(map.per_x + map.per_y), Length(map.per_x - map.per_y))));
  const auto add = [&](Vec2d a, Vec2d b, Vec2d c, bool whole, double share) {
    const float before = parts_.empty() ? 0.0f : parts_.back().cdf;
    const Vec3d p = map.At(a);
    parts_.push_back({ToFloat(p), ToFloat(map.At(b) - p), ToFloat(map.At(c) - p), ToUnit(a, texel),
                      ToUnit(b, texel) - ToUnit(a, texel), ToUnit(c, texel) - ToUnit(a, texel), whole,
                      static_cast<uint16_t>(sides_.size() - 1), before + static_cast<float>(share)});
  };
  if (area > window.side * window.side * (1 - 1e-6)) {
    return add(window.corner, window.corner + Vec2d{window.side, 0}, window.corner + Vec2d{0, window.side}, true, area);
  }
  for (int i = 1; i + 1 < polygon.count; ++i) {
    const Vec2d a = polygon.corner[0], b = polygon.corner[i], c = polygon.corner[i + 1];
    add(a, b, c, false, 0.5 * std::fabs(Cross(b - a, c - a)));
  }
}

TexelSampler::TexelSampler(const World& world, const AtlasLayout& layout, const TexelMap& map, const Texel& texel) {
  const Vec2d corner{static_cast<double>(texel.x), static_cast<double>(texel.y)};
  const double inset = 0.5 - 0.5 * static_cast<double>(map.footprint);
  for (const Window& window : {Window{corner + Vec2d{inset, inset}, map.footprint}, Window{corner, 1}}) {
    for (uint32_t f = texel.fragment_begin; f < texel.fragment_end; ++f) {
      AddFragment(world, layout, map.fragments[f], window, corner);
    }
    if (!parts_.empty()) break;
  }
  BAKEWELL_CHECK(!parts_.empty());
  const float total = parts_.back().cdf;
  for (Part& part : parts_) part.cdf = total > 0 ? part.cdf / total : 1.0f;
}

int TexelSampler::MaskBit(Place place) {
  const Vec2f p = place.part->uv0 + place.part->d1 * place.b.x + place.part->d2 * place.b.y;
  return 4 * std::clamp(static_cast<int>(p.y * 4), 0, 3) + std::clamp(static_cast<int>(p.x * 4), 0, 3);
}

void TexelSampler::MoveTo(Vec3f position) {
  moved_ = true;
  moved_to_ = position;
}

TexelSampler::Place TexelSampler::Find(Vec2f u) const {
  size_t k = 0;
  while (k + 1 < parts_.size() && u.x >= parts_[k].cdf) ++k;
  const float begin = k == 0 ? 0 : parts_[k - 1].cdf;
  const float width = parts_[k].cdf - begin;
  const Vec2f within{width > 0 ? std::clamp((u.x - begin) / width, 0.0f, 0x1.fffffep-1f) : 0.5f, u.y};
  return {&parts_[k], parts_[k].whole ? within : TriangleFromSquare(within)};
}

int TexelSampler::BitAt(Vec2f u) const { return MaskBit(Find(u)); }

TexelPoint TexelSampler::At(Vec2f u) const {
  const Place place = Find(u);
  const Part& part = *place.part;
  const Side& side = sides_[part.side];
  TexelPoint point;
  point.surface = {part.p0 + part.e1 * place.b.x + part.e2 * place.b.y, side.frame.n, side.offset};
  point.frame = side.frame;
  if (moved_) {
    point.surface.position = moved_to_;
  } else if (valid_mask_ != 0xffff) {
    point.valid = valid_mask_ >> MaskBit(place) & 1;
  }
  return point;
}

}  // namespace bakewell
