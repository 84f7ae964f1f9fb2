#pragma once

#include <string>
#include <vector>

#include "server/chart/atlas.h"

namespace bakewell::chart {

// The naive judge of an atlas, independent of the code under test: every texel centre against every triangle of every
// page, in exact 64-bit arithmetic on a grid of 1/4096 texel. Returns what is wrong, or "" : unmapped or doubly mapped
// triangles, UVs outside the page or not finite, flipped triangles, texel centres covered twice, charts closer than
// `padding` texels.
std::string FindFault(const MeshDecl& decl, const Atlas& atlas, uint32_t padding);

}  // namespace bakewell::chart
