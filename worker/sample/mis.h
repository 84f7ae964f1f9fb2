#pragma once

namespace bakewell {

// Weight of a sample with density `pdf` where another technique would have drawn it with density `other`: the power
// heuristic, exponent 2 (Veach 1997, section 9.2). Next to the balance heuristic it leaves a small light wholly to
// light sampling, so that a gather that stops before it met the light by chance does not lose a share of it.
inline float PowerHeuristic(float pdf, float other) {
  if (!(pdf > 0)) return 0;
  const float ratio = other / pdf;
  return 1 / (1 + ratio * ratio);
}

}  // namespace bakewell
