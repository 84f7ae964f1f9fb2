#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/math/vec.h"

namespace bakewell {

// A density over the primary samples of GatherHemisphere (cosine, azimuth), constant in each cell of a grid: where a
// texel's light comes from.
class GatherGuide {
 public:
  static constexpr int kRows = 8, kColumns = 16;  // cosine, azimuth
  static constexpr int kCells = kRows * kColumns;

  // Where GatherHemisphere's direction lies, unit, about +z: row * kColumns + column.
  static size_t CellOf(Vec3f local);
  // weight: kCells, row by row, all above zero.
  explicit GatherGuide(const std::array<float, kCells>& weight);

  struct Sample {
    Vec2f primary;  // in the unit square
    float density;  // its mean over the square is 1
  };
  // Maps uniform u to the density, cell by cell in order, so that well spread points stay well spread.
  Sample Draw(Vec2f u) const;
  // The density in the cell of a unit direction about +z.
  float Density(Vec3f local) const;

 private:
  std::array<float, kRows> row_cdf_;
  std::array<float, kCells> cell_cdf_;  // within the row
};

// Light that the first rays of a tile's texels found, to guide the others by.
class FoundLight {
 public:
  // A ray whose primary sample had this density brought `luminance` (of its share of the irradiance [W m^-2], over the
  // density) from the point `place`, or from the direction `place` at infinity.
  void Add(Vec3f place, bool at_infinity, float luminance, float density);

  // Keeps some of the rays, each as often as the square of its light says. `rays`: how many there were with those that
  // brought nothing; `u` in [0, 1) decides which are kept.
  void Resample(double rays, float u);

  // The guide of a texel at `position`: to the root mean square of the light in each part of the hemisphere about
  // `frame`, which leaves the least variance, and in part uniform, so that no direction is lost. Nothing where it
  // would gain next to nothing.
  std::optional<GatherGuide> GuideAt(Vec3f position, const Frame& frame) const;

 private:
  struct Ray {
    Vec3f place;
    bool at_infinity;
    float luminance, density;
    double Square() const {
      return static_cast<double>(luminance) * static_cast<double>(luminance) * static_cast<double>(density);
    }
  };
  std::vector<Ray> rays_;
  // Of those that are kept, one after the other: directions from p are (x, y, z) - near p.
  std::vector<float> x_, y_, z_, near_;
  double mean_share_ = 0;  // square of the rays' mean luminance, over their mean square
};

}  // namespace bakewell
