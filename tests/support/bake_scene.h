#pragma once

#include <vector>

#include "client/local/bake_texels.h"
#include "core/scene/scene.h"

namespace bakewell {

// Progress that nobody reads.
class SilentProgress : public Progress {
 public:
  void Report(std::string_view, int64_t, int64_t) override {}
};

// A scene baked in memory, without a file: its texels and their light, element i for element i.
struct BakedScene {
  PreparedLevel prepared;
  BakedTexels baked;

  const std::vector<Texel>& texels() const { return prepared.texels.texels; }
  const std::vector<TexelLight>& lights() const { return baked.lights; }
};

// The scene's own TEXCOORD_1 on its page. Fails the test where the bake fails.
BakedScene BakeSceneInMemory(const Scene& scene, BakeSettings settings);
PreparedLevel PrepareInMemory(const Scene& scene, BakeSettings settings);

}  // namespace bakewell
