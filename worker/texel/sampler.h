#pragma once

#include <optional>
#include <vector>

#include "worker/texel/texels.h"

namespace bakewell {

// Where a gather or shadow ray of a texel starts.
struct TexelPoint {
  SurfacePoint surface;
  Frame frame;        // n: the geometric normal; t: the direction in which u grows
  bool valid = true;  // false inside other geometry: the sample does not count
};

// Draws points uniformly over the covered part of one texel's footprint: the square of side TexelMap::footprint about
// its centre, or all of the texel where the footprint holds no surface.
class TexelSampler {
 public:
  TexelSampler(const World& world, const AtlasLayout& layout, const TexelMap& map, const Texel& texel);

  // Pdf 1/(covered area of the footprint). Points in the parts that `valid_mask` rules out come back with valid ==
  // false.
  TexelPoint At(Vec2f u) const { return PointAt(Find(u)); }
  // The reference's rule, for the hard edges of directional lights: a footprint that leaves the triangle under the
  // texel's centre is mirrored back into it in barycentric coordinates, where that triangle holds a good part of it;
  // else At(u).
  TexelPoint AtMirrored(Vec2f u) const { return mirrored_ ? PointAt(FindMirrored(u)) : At(u); }
  // The bit of valid_mask that decides about At(u).
  int BitAt(Vec2f u) const;

  // Bit 4 * row + column set: that sixteenth of the texel's square is outside other geometry.
  uint16_t valid_mask() const { return valid_mask_; }
  void set_valid_mask(uint16_t mask) { valid_mask_ = mask; }
  // All points move to this place (a texel pushed out of a solid).
  void MoveTo(Vec3f position);
  // Least height of what is drawn from over a plane with unit normal `normal` through `origin` [m].
  float LeastHeight(Vec3f origin, Vec3f normal) const;
  // Half the diagonal of the texel on the surface [m].
  float radius() const { return radius_; }

 private:
  // A parallelogram (the whole footprint) or a triangle of a clipped polygon's fan.
  struct Part {
    Vec3f p0, e1, e2;   // [m]
    Vec2f uv0, d1, d2;  // in the texel's square, [0,1]
    bool whole = false;
    uint16_t side = 0;  // index into sides_
    float cdf = 0;      // share of the coverage up to and with this part
  };
  // The triangle under the centre: barycentrics of the centre, and across the footprint.
  struct MirroredPart {
    Part triangle;
    Vec2f center, dx, dy;
  };
  struct Side {
    Frame frame;
    float offset;
    uint32_t triangle;
  };
  struct Place {
    const Part* part;
    Vec2f b;
  };
  Place Find(Vec2f u) const;
  Place FindMirrored(Vec2f u) const;
  TexelPoint PointAt(Place place) const;
  static int MaskBit(Place place);
  struct Window {
    Vec2d corner;
    double side;
  };
  void AddFragment(const World& world, const AtlasLayout& layout, const TexelFragment& fragment, const Window& window,
                   Vec2d texel);

  void AddMirrored(const World& world, const AtlasLayout& layout, const TexelFragment& fragment, const Window& window,
                   Vec2d texel);
  void AddSide(const World& world, uint32_t triangle, Vec3d per_x, Vec3d per_y);

  std::vector<Part> parts_;
  std::optional<MirroredPart> mirrored_;
  std::vector<Side> sides_;
  uint16_t valid_mask_ = 0xffff;
  bool moved_ = false;
  Vec3f moved_to_;
  float radius_ = 0;
};

}  // namespace bakewell
