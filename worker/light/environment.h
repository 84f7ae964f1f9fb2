#pragma once

#include "core/scene/scene.h"
#include "worker/sample/distribution.h"

namespace bakewell {

// Distant light around the scene, with a table to sample it by luminance. Directions are unit, world frame.
class EnvironmentLight {
 public:
  explicit EnvironmentLight(const Environment& environment);

  // False where no direction is bright: then nothing else may be called but Radiance.
  bool bright() const { return bright_; }
  EnvironmentType type() const { return environment_.type; }
  // True where rays drawn over the hemisphere find it well enough without being aimed at its bright parts.
  bool smooth() const { return environment_.type != EnvironmentType::kLatLong; }

  Rgb Radiance(Vec3f dir) const;

  struct Sample {
    Vec3f dir;
    float pdf = 0;  // per steradian
  };
  // Directions by luminance (of the table's cells).
  Sample Draw(Vec2f u) const;
  float Pdf(Vec3f dir) const;
  // Integral of radiance over the sphere [W m^-2].
  Rgb Fluence() const { return fluence_; }

  // The table's grid: latitude-longitude, row 0 at +Y.
  int width() const { return table_.width(); }
  int height() const { return table_.height(); }
  Vec3f CellCenter(int x, int y) const;
  // Solid angle of a cell of row y [sr].
  float CellSolidAngle(int y) const;

 private:
  void CellOf(Vec3f dir, int& x, int& y) const;
  Environment environment_;
  Distribution2D table_;
  bool bright_ = false;
  Rgb fluence_;
};

}  // namespace bakewell
