#pragma once

#include "tests/support/scene_builder.h"

namespace bakewell {

// A similarity that a scene is built under: scaled, turned about y, moved. Directions are only turned.
struct Placement {
  double scale = 1;
  double turn_rad = 0;
  Vec3d offset_m{0, 0, 0};

  Vec3d Direction(Vec3d d) const;
  Vec3d Point(Vec3d p) const { return Direction(p) * scale + offset_m; }
};

// Which lights of the studio are on.
struct StudioLights {
  bool point = true, spot = true, panel = true, sun = true, sky = true;
};

inline constexpr int kStudioPage = 32;

// A room of 4 x 3 x 5 m with a window in the wall at x = 4, a half-transparent curtain before it, a box, a panel that
// emits, a point and a spot light, a sun of the real one's size and a gradient sky. Radiances and irradiances do not
// depend on the placement; intensities grow with the square of its scale. Order of the objects: of the calls, not
// canonical.
Scene Studio(const Placement& placement = {}, const StudioLights& on = {});

}  // namespace bakewell
