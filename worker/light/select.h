#pragma once

#include "worker/light/lights.h"
#include "worker/sample/distribution.h"

namespace bakewell {

// Chooses one local light for a path vertex, in proportion to radiated flux.
class LightSelector {
 public:
  explicit LightSelector(const LightSet& lights);

  bool empty() const { return empty_; }
  struct Choice {
    int light = -1;
    float probability = 0;
  };
  Choice Pick(float u) const;
  float Probability(int light) const { return empty_ ? 0 : distribution_.Probability(light); }

 private:
  bool empty_ = true;
  Distribution1D distribution_;
};

}  // namespace bakewell
