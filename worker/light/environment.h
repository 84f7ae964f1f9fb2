#pragma once

#include <span>
#include <vector>

#include "core/scene/scene.h"
#include "worker/sample/distribution.h"

namespace bakewell {

// Directions over the sphere with a density that is constant in each cell of a latitude-longitude grid, row 0 at +Y.
class SphereTable {
 public:
  SphereTable() = default;
  // Weights: of whole cells.
  SphereTable(int width, int height, std::span<const float> weights);

  struct Sample {
    Vec3f dir;      // unit
    float pdf = 0;  // per steradian
    int x = 0, y = 0;
  };
  Sample Draw(Vec2f u) const;
  float Pdf(int x, int y) const;
  int width() const { return cells_.width(); }
  int height() const { return cells_.height(); }
  // Solid angle of a cell of row y [sr].
  float CellSolidAngle(int y) const { return solid_angle_[static_cast<size_t>(y)]; }

 private:
  Distribution2D cells_;
  std::vector<float> cosine_;       // of the polar angle at the top of each row, and at the last one's bottom
  std::vector<float> solid_angle_;  // of a cell, per row
};

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

  // Directions by luminance (of the table's cells).
  SphereTable::Sample Draw(Vec2f u) const { return table_.Draw(u); }
  float Pdf(Vec3f dir) const;
  // Integral of radiance over the sphere [W m^-2].
  Rgb Fluence() const { return fluence_; }

  // The table's grid: latitude-longitude, row 0 at +Y.
  int width() const { return table_.width(); }
  int height() const { return table_.height(); }
  Vec3f CellCenter(int x, int y) const;
  float CellSolidAngle(int y) const { return table_.CellSolidAngle(y); }

 private:
  void CellOf(Vec3f dir, int& x, int& y) const;
  Environment environment_;
  SphereTable table_;
  bool bright_ = false;
  Rgb fluence_;
};

}  // namespace bakewell
