#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/math/vec.h"
#include "server/chart/flatten/flat_chart.h"

namespace bakewell::chart {

// The UVs that a mesh brings. uv: V; index: 3 T of the input.
struct InputUv {
  std::span<const Vec2f> uv;
  std::span<const uint32_t> index;
};

// 3 F flags: across edge k of face f the input's UVs differ at an end.
std::vector<uint8_t> InputSeams(const Surface& surface, const InputUv& input);

// Forgets neighbours across seams, so that charts end there.
void CutAlong(std::span<const uint8_t> seam, Surface& surface);

// The chart that the input's UVs make of these faces, mirrored where they run clockwise. Nothing: they are not
// finite, turn some face over or overlap.
std::optional<FlatChart> ChartFromInput(const Surface& surface, std::span<const uint32_t> faces, const InputUv& input);

}  // namespace bakewell::chart
