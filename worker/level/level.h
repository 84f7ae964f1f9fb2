#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "core/artifact/settings.h"
#include "core/base/fields.h"
#include "worker/gather/skip.h"
#include "worker/gather/tile.h"
#include "worker/light/tree.h"
#include "worker/texel/pages.h"

namespace bakewell {

// Samples, photons and target of a quality, with the settings' own numbers in their place.
struct Budget {
  GatherOptions gather;
  int64_t least_photons = 0, most_photons = 0;  // PhotonsFor chooses
};

// How the photons' density is estimated.
DensityOptions DensityOf(const BakeSettings& settings);

Budget BudgetOf(const BakeSettings& settings, int64_t texels);

// A scene with its charts, ready to be traced. Immutable; made once and shared by the tasks that need it.
struct Level {
  Scene scene;
  AtlasLayout layout;
  std::unique_ptr<World> world;
  std::unique_ptr<LightSet> lights;
  std::unique_ptr<LightTree> tree;  // over them
  std::unique_ptr<TexelPages> texels;
};
inline constexpr int kSurveySteps = 5;  // of phase "texels"; the last is the survey's own
// A large level takes seconds: reports its steps to `progress` and looks at it in between whether to stop.
// kInvalidArgument: no lightmapped surface covers a texel. kCancelled.
absl::StatusOr<std::shared_ptr<const Level>> BuildLevel(Scene scene, AtlasLayout layout, const BakeSettings& settings,
                                                        Progress& progress);

// Mean luminance that the photons brought to the fronts of lightmapped surfaces, to judge errors against.
float MeanIrradiance(const TexelMap& texels, const SurfaceCells& cells, const RadianceCache& cache);
float MeanIrradiance(const TexelPages& texels, const SurfaceCells& cells, const RadianceCache& cache);

// Keeps the few values that were asked for last; threads that ask for the same key wait for one to make it.
template <typename Value>
class Recent {
 public:
  using Made = absl::StatusOr<std::shared_ptr<const Value>>;
  explicit Recent(size_t capacity) : capacity_(capacity) {}
  Made Get(const Digest& key, const std::function<Made()>& make) {
    const std::shared_ptr<Entry> entry = Find(key);
    const std::lock_guard making(entry->mutex);
    if (entry->value == nullptr) {
      Made made = make();
      if (!made.ok()) return made;
      entry->value = *std::move(made);
    }
    return entry->value;
  }

 private:
  struct Entry {
    std::mutex mutex;
    std::shared_ptr<const Value> value;
    uint64_t used = 0;
  };
  std::shared_ptr<Entry> Find(const Digest& key) {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Entry>& entry = entries_[key];
    if (entry == nullptr) entry = std::make_shared<Entry>();
    entry->used = ++clock_;
    const std::shared_ptr<Entry> found = entry;
    while (entries_.size() > capacity_) {
      auto oldest = entries_.begin();
      for (auto other = entries_.begin(); other != entries_.end(); ++other) {
        if (other->second->used < oldest->second->used) oldest = other;
      }
      entries_.erase(oldest);
    }
    return found;
  }

  const size_t capacity_;
  std::mutex mutex_;
  std::map<Digest, std::shared_ptr<Entry>> entries_;
  uint64_t clock_ = 0;
};

}  // namespace bakewell
