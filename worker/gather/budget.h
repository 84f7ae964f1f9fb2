#pragma once

#include <optional>
#include <vector>

#include "worker/filter/smooth_tile.h"
#include "worker/gather/allot.h"
#include "worker/gather/tile.h"
#include "worker/gather/work.h"

namespace bakewell {

// Which texels of a tile go on sampling: all errors together are to meet the target, those of direct and of indirect
// light after filtering where the page will be filtered.
class TileBudget {
 public:
  TileBudget(const TexelMap& map, uint32_t begin, const GatherOptions& options)
      : map_(map), begin_(begin), options_(options) {}

  // tile: connected, without values.
  void WillBeFiltered(SmoothTile tile);

  // What a texel of this irradiance (luminance) may be off by [W m^-2]: between equal absolute and equal relative
  // errors, for what matters to the root mean square and to the eye.
  float Tolerated(float irradiance) const { return options_.target_error * Weighing(irradiance); }

  // After a round of those that are active: corrects their variances, and makes active who takes part in the next.
  // work: one element a texel of the tile.
  void Decide(std::vector<TexelWork>& work);

 private:
  // Direct or indirect light of a tile, luminance; one element a texel.
  struct Part {
    std::vector<float> value, variance, pooled;  // pooled: variance over the neighbourhood, later after filtering
    std::vector<int> samples;
    void Add(Rgb irradiance, float its_variance, int its_samples);
  };
  // What the filter will make of a part, when it was last looked at as a whole.
  struct Filtered {
    std::vector<SimilarTexels::Mean> smoothed;
    std::vector<float> bias_square;  // of each, by it and its neighbours
    float changed = 0;               // texels that went on since
    void Apply(SmoothTile& tile, const TilePool& pool, Part& part);
  };

  float Weighing(float irradiance) const;
  void CorrectVariances(std::vector<TexelWork>& work) const;
  Demand DemandOf(const std::vector<TexelWork>& work, const Part& direct, const Part& indirect,
                  const std::vector<float>& light) const;
  void Grant(const Demand& demand, std::vector<TexelWork>& work);

  const TexelMap& map_;
  const uint32_t begin_;
  const GatherOptions& options_;
  std::optional<SmoothTile> tile_;
  std::optional<TilePool> pool_;
  Filtered direct_, indirect_;
  std::optional<double> spare_;  // of Allot
};

}  // namespace bakewell
