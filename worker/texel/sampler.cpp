#include "worker/texel/sampler.h"

#include <cmath>
#include <limits>

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
  AddSide(world, fragment.triangle, map.per_x, map.per_y);
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

void TexelSampler::AddSide(const World& world, uint32_t triangle, Vec3d per_x, Vec3d per_y) {
  const SurfacePoint point = world.PointAt(triangle, 0, 0, false);
  sides_.push_back({FrameFromHint(point.normal, ToFloat(NormalizeOrZero(per_x))), point.offset, triangle});
  radius_ = std::max(radius_, static_cast<float>(0.5 * std::max(Length(per_x + per_y), Length(per_x - per_y))));
}

namespace {

constexpr double kMirroredShare = 0.25;  // of the footprint that the triangle under the centre must hold

// x in [0, max], reflected at both ends as often as needed.
float Mirror(float x, float max) {
  if (!(max > 0)) return 0;
  const float period = x / max - 2 * std::floor(0.5f * x / max);
  return (period > 1 ? 2 - period : period) * max;
}

}  // namespace

void TexelSampler::AddMirrored(const World& world, const AtlasLayout& layout, const TexelFragment& fragment,
                               const Window& window, Vec2d texel) {
  const Triangle& t = world.triangles()[fragment.triangle];
  const auto c = TexelCorners(world, layout, fragment.triangle);
  const Vec2d a = c[0] - c[2], b = c[1] - c[2], to_center = texel + Vec2d{0.5, 0.5} - c[2];
  const double det = Cross(a, b);
  if (det == 0) return;
  const Vec2d center{Cross(to_center, b) / det, Cross(a, to_center) / det};
  if (center.x < 0 || center.y < 0 || center.x + center.y > 1) return;
  const ConvexPolygon inside = ClipToSquare({3, {c[0], c[1], c[2]}}, window.corner, window.side);
  const double share = std::fabs(inside.SignedArea()) / (window.side * window.side);
  if (share < kMirroredShare || share > 1 - 1e-6) return;
  const PageToWorld map = MapOf(t, c);
  AddSide(world, fragment.triangle, map.per_x, map.per_y);
  const auto narrow = [](double x, double y) { return Vec2f{static_cast<float>(x), static_cast<float>(y)}; };
  const Part triangle{t.p0 + t.e2,
                      -t.e2,
                      t.e1 - t.e2,
                      ToUnit(c[2], texel),
                      ToUnit(c[0], c[2]),
                      ToUnit(c[1], c[2]),
                      false,
                      static_cast<uint16_t>(sides_.size() - 1),
                      1};
  mirrored_ =
      MirroredPart{triangle, narrow(center.x, center.y), narrow(window.side * b.y / det, -window.side * a.y / det),
                   narrow(-window.side * b.x / det, window.side * a.x / det)};
}

TexelSampler::TexelSampler(const World& world, const AtlasLayout& layout, const TexelMap& map, const Texel& texel) {
  const Vec2d corner{static_cast<double>(texel.x), static_cast<double>(texel.y)};
  const double inset = 0.5 - 0.5 * static_cast<double>(map.footprint);
  const Window footprint{corner + Vec2d{inset, inset}, map.footprint};
  for (const Window& window : {footprint, Window{corner, 1}}) {
    for (uint32_t f = texel.fragment_begin; f < texel.fragment_end; ++f) {
      AddFragment(world, layout, map.fragments[f], window, corner);
    }
    if (!parts_.empty()) break;
  }
  for (uint32_t f = texel.fragment_begin; f < texel.fragment_end && !mirrored_; ++f) {
    AddMirrored(world, layout, map.fragments[f], footprint, corner);
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

TexelSampler::Place TexelSampler::FindMirrored(Vec2f u) const {
  const Vec2f b = mirrored_->center + mirrored_->dx * (u.x - 0.5f) + mirrored_->dy * (u.y - 0.5f);
  const float first = Mirror(b.x, 1);
  return {&mirrored_->triangle, {first, Mirror(b.y, 1 - first)}};
}

int TexelSampler::BitAt(Vec2f u) const { return MaskBit(Find(u)); }

TexelPoint TexelSampler::PointAt(Place place) const {
  const Part& part = *place.part;
  const Side& side = sides_[part.side];
  TexelPoint point;
  point.surface = {part.p0 + part.e1 * place.b.x + part.e2 * place.b.y, side.frame.n, side.offset, side.triangle};
  point.frame = side.frame;
  if (moved_) {
    point.surface.position = moved_to_;
    point.surface.triangle = kNoTriangle;
  } else if (valid_mask_ != 0xffff) {
    point.valid = valid_mask_ >> MaskBit(place) & 1;
  }
  return point;
}

float TexelSampler::LeastHeight(Vec3f origin, Vec3f normal) const {
  float least = std::numeric_limits<float>::infinity();
  for (const Part& part : parts_) {
    const float height = Dot(part.p0 - origin, normal), rise1 = Dot(part.e1, normal), rise2 = Dot(part.e2, normal);
    least = std::min({least, height, height + rise1, height + rise2});
    if (part.whole) least = std::min(least, height + rise1 + rise2);
  }
  return least;
}

}  // namespace bakewell
