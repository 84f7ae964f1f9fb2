#pragma once

#include <string>

#include "tests/bench/kernel/embree_rays.h"
#include "worker/level/photons.h"
#include "worker/light/tree.h"

namespace bakewell {

// A level with its photons, ready for a gather of 64 samples a texel, one thread.
struct KernelLevel {
  std::string name;
  std::shared_ptr<const Level> level;
  std::shared_ptr<const TexelMap> texels;  // of the first page
  std::shared_ptr<const PhotonStage> stage;
  PhotonMap photons;
  RadianceCache cache;
  std::unique_ptr<LightTree> tree;
  GatherOptions options;
  std::unique_ptr<BareScene> bare;
  RayRecording rays;  // of a few tiles spread over the level

  GatherScene scene() const { return {*level->world, *level->lights, *tree, stage->cells, cache}; }
  // Every k-th tile, so that there are about `count`.
  std::vector<int> Tiles(int count) const;
};

// kNotFound, kInvalidArgument as LoadLevel and BuildLevel.
absl::StatusOr<std::unique_ptr<KernelLevel>> LoadKernelLevel(const std::string& path);

}  // namespace bakewell
