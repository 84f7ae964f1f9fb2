#pragma once

#include <span>
#include <vector>

#include "core/artifact/progress.h"
#include "worker/light/lights.h"
#include "worker/sample/distribution.h"
#include "worker/texel/sampler.h"

namespace bakewell {

// Where photons of the sun and the sky are worth emitting. Distant light is emitted from a square of side 2R behind the
// scene's bounding sphere, across its direction; most of it would end on roofs that no texel sees. A pilot walks from
// texels into the scene (importance runs backwards, Peter & Pietrek 1998) and, at every surface that a texel sees,
// marks from which part of the square, and for the sky from which direction, light arrives. Emission follows the marks,
// widened by one bin, the sky's in part by blocks of bins, with a share kept uniform, so that nothing is ever missed:
// the estimate stays unbiased.
class EmissionGuide {
 public:
  static constexpr int kSunGrid = 64, kSkyGrid = 16, kSkyColumns = 16, kSkyRows = 8;
  static constexpr float kUniformShare = 0.1f;

  // Where pilot walk `walk` starts: at point `u` of texel `texel` of `texels`.
  struct Start {
    size_t texel = 0;
    Vec2f u;
  };
  static Start StartOf(int walk, size_t texels, uint32_t seed);
  // The points that the first `walks` walks start at, in a map of all texels.
  static std::vector<TexelPoint> StartsIn(const World& world, const AtlasLayout& layout, const TexelMap& map, int walks,
                                          uint32_t seed);
  // Walks for a bake of `photons`.
  static int WalksFor(const LightSet& lights, int64_t photons);
  // starts[walk] is the point that StartOf(walk) means. Keyed by seed.
  static EmissionGuide Learn(const World& world, const LightSet& lights, std::span<const TexelPoint> starts,
                             uint32_t seed);
  // The same over texels that are all there. walks: number of pilot paths.
  static EmissionGuide Learn(const World& world, const LightSet& lights, const AtlasLayout& layout, const TexelMap& map,
                             int walks, uint32_t seed);

  struct SquarePoint {
    Vec2f position;     // in [-1, 1]^2, in units of R
    float density = 0;  // relative to uniform (1 = uniform)
  };
  SquarePoint DrawSun(int directional, Vec2f u) const { return Draw(sun_[directional], u); }
  struct SkyPoint {
    Vec3f dir;      // unit, towards the sky
    Frame across;   // of the square behind the scene, n = dir
    float pdf = 0;  // per steradian
    SquarePoint point;
  };
  SkyPoint DrawSky(Vec2f u_direction, Vec2f u_position) const;

  // Share of the square's area (sun) or of the sky's flux that reaches what texels see, (0, 1], by how far marks
  // spread.
  float UsefulSun(int directional) const { return sun_useful_[directional]; }
  float UsefulSky() const { return sky_useful_; }
  // How many of the walks' rays met each triangle.
  const std::vector<uint32_t>& seen() const { return seen_; }

 private:
  struct Marks;
  static SquarePoint Draw(const Distribution2D& table, Vec2f u);
  int SkyBin(int x, int y) const;
  Vec3f SkyToWorld(Vec3f v) const { return sky_axes_.t * v.x + sky_axes_.n * v.y - sky_axes_.b * v.z; }
  Vec3f SkyToLocal(Vec3f v) const { return {Dot(v, sky_axes_.t), Dot(v, sky_axes_.n), -Dot(v, sky_axes_.b)}; }
  // Frame across unit `dir`, given in the sky's axes.
  Frame SkySquare(Vec3f dir) const;
  void Finish(const LightSet& lights, const Marks& marks);
  void FinishSky(const EnvironmentLight& sky, const Marks& marks);

  std::vector<Distribution2D> sun_;
  std::vector<float> sun_useful_;
  SphereTable sky_direction_;                 // over the environment's table
  std::vector<Distribution2D> sky_position_;  // per direction bin
  int sky_width_ = 1, sky_height_ = 1;
  Frame sky_axes_;  // n: up, t: azimuth 0
  float sky_useful_ = 1;
  std::vector<uint32_t> seen_;
};

// The square of a sun's photons; it turns with the light's node.
Frame SunFrame(const PunctualLight& light);

}  // namespace bakewell
