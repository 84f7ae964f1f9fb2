#include "worker/light/select.h"

namespace bakewell {

LightSelector::LightSelector(const LightSet& lights) : empty_(lights.local_count() == 0) {
  if (empty_) return;
  std::vector<float> power(static_cast<size_t>(lights.local_count()));
  for (int i = 0; i < lights.local_count(); ++i) power[i] = lights.Power(i);
  distribution_ = Distribution1D(power);
}

LightSelector::Choice LightSelector::Pick(float u) const {
  const auto drawn = distribution_.Draw(u);
  return {drawn.index, drawn.probability};
}

}  // namespace bakewell
