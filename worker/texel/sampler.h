#pragma once

#include <vector>

#include "worker/texel/texels.h"

namespace bakewell {

// Where a gather or shadow ray of a texel starts.
struct TexelPoint {
  SurfacePoint surface;
  Frame frame;        // n: the geometric normal; t: the direction in which u grows
  bool valid = true;  // false inside other geometry: the sample does not count
};

// Draws points uniformly over the covered part of one texel's footprint (the square of side TexelMap::footprint about
// its centre), or over all of the texel that is covered where the footprint holds no surface.
class TexelSampler {
 public:
  TexelSampler(const World& world, const AtlasLayout& layout, const TexelMap& map, const Texel& texel);

  // Pdf 1/(covered area of the footprint). Points in the parts that `valid_mask` rules out come back with valid ==
  // false.
  TexelPoint At(Vec2f u) const;
  // The bit of valid_mask that decides about At(u).
  int BitAt(Vec2f u) const;

  // Bit 4 * row + column set: that sixteenth of the texel's square is outside other geometry.
  uint16_t valid_mask() const { return valid_mask_; }
  void set_valid_mask(uint16_t mask) { valid_mask_ = mask; }
  // All points move to this place (a texel pushed out of a solid).
  void MoveTo(Vec3f position);
  // Half the diagonal of the texel on the surface [m].
  float radius() const { return radius_; }

 private:
  // A parallelogram (whole texel) or a triangle of a clipped polygon's fan.
  struct Part {
    Vec3f p0, e1, e2;   // [m]
    Vec2f uv0, d1, d2;  // in the texel's square, [0,1]
    bool whole = false;
    uint16_t side = 0;  // index into sides_
    float cdf = 0;      // share of the coverage up to and with this part
  };
  struct Side {
    Frame frame;
    float offset;
  };
  struct Place {
    const Part* part;
    Vec2f b;
  };
  Place Find(Vec2f u) const;
  static int MaskBit(Place place);
  struct Window {
    Vec2d corner;
    double side;
  };
  void AddFragment(const World& world, const AtlasLayout& layout, const TexelFragment& fragment, const Window& window,
                   Vec2d texel);

  std::vector<Part> parts_;
  std::vector<Side> sides_;
  uint16_t valid_mask_ = 0xffff;
  bool moved_ = false;
  Vec3f moved_to_;
  float radius_ = 0;
};

}  // namespace bakewell
