#pragma once

#include <cstdint>
#include <optional>

#include "core/artifact/skip.h"
#include "core/base/status.h"
#include "core/scene/scene.h"

namespace bakewell {

enum class UvMode : uint8_t { kAuto, kKeep, kGenerate };  // auto: keep where every lightmapped object has TEXCOORD_1
// Texel density of generated charts: one for all, or after a preview of the light (client/local/signal_density.h).
enum class DensityMode : uint8_t { kUniform, kSignal };
enum class BackfaceMode : uint8_t { kReflect, kAbsorb, kPass };
enum class Quality : uint8_t { kPreview, kMedium, kHigh };

// Everything that changes what a bake gives, and nothing else: it is part of every task's key. Zero means "chosen for
// me" where it says so.
struct BakeSettings {
  UvMode uv = UvMode::kAuto;
  DensityMode density = DensityMode::kUniform;  // kSignal: not with UvMode::kKeep, and not on a farm
  int resolution = 0;          // page side in texels; 0: scene.extras.lightmap, else from texels_per_metre
  float texels_per_metre = 0;  // 0: from resolution, else 8
  float footprint = 0.5f;      // side of the square about a texel's centre that its value averages [texels], (0, 1]
  bool filter = true;          // smooth what noise hides
  BackfaceMode backfaces = BackfaceMode::kReflect;
  Quality quality = Quality::kMedium;
  float target_error = 0;      // relative standard error at which a texel stops; 0: the quality's
  int min_samples = 0;         // gather rays a texel, power of two; 0: the quality's
  int max_samples = 0;         // power of two; 0: the quality's
  int64_t photons = 0;         // photons emitted; 0: as many as the target error needs, up to the quality's most
  int photon_batches = 8;      // tasks the photons are split into; does not change any byte
  float albedo_limit = 0.98f;  // theory.md 1
  uint32_t seed = 0;
  SkipSet no_skip;                         // what is computed although it seems not to matter
  std::optional<Environment> environment;  // replaces the scene's
};

// kInvalidArgument, naming the setting, its range and its value, where one is outside its range.
absl::Status ValidateSettings(const BakeSettings& settings);

}  // namespace bakewell
