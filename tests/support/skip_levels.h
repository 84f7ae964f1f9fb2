#pragma once

#include "core/scene/scene.h"

namespace bakewell {

// Levels that give a bake something to leave out. `page` is the side of their lightmap in texels.

// Ten sealed rooms in a row, of which the first `lit` have a lamp and a glowing panel.
Scene RoomsLevel(int page, int lit);
// A room with lamps, sealed under a sun and a picture of a sky, and ground outside.
Scene BunkerLevel(int page);
// A plane under a uniform sky.
Scene PlaneLevel(int page);
// Ground under a sun and a sky, with a hundred trees of one alpha-masked material: trunks where it is opaque, leaves
// where it has holes.
Scene FoliageLevel(int page);
// A dark room beside a lit one; `gap_m` wide, a slit in the wall between them lets a streak of light through.
Scene SlitLevel(int page, double gap_m);
// A floor of 60 x 60 m under 1,024 spot lights that point down.
Scene SpotsLevel(int page);

}  // namespace bakewell
