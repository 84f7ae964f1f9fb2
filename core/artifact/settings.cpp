#include "core/artifact/settings.h"

#include <absl/strings/str_cat.h>

#include <bit>
#include <cmath>
#include <string>

namespace bakewell {
namespace {

constexpr int kSmallestPage = 4;
constexpr int kLargestPage = 16384;
constexpr int kMostSamples = 1 << 20;
constexpr int64_t kMostPhotons = int64_t{1} << 40;
constexpr int kMostBatches = 1 << 16;
constexpr float kDensestTexelsPerMetre = 10000;

template <typename T>
absl::Status Refuse(const char* name, const char* rule, T value) {
  return absl::InvalidArgumentError(absl::StrCat(name, " must be ", rule, ", not ", value));
}

absl::Status CheckSamples(const char* name, int samples) {
  const bool fits = samples >= 0 && samples <= kMostSamples && (samples == 0 || std::has_single_bit(unsigned(samples)));
  return fits ? absl::OkStatus() : Refuse(name, "a power of two up to 1048576, or 0", samples);
}

absl::Status CheckPage(const BakeSettings& settings) {
  const int side = settings.resolution;
  if (side != 0 && (side < kSmallestPage || side > kLargestPage)) {
    return Refuse("resolution", "4 to 16384 texels, or 0", side);
  }
  const float density = settings.texels_per_metre;
  if (!(density >= 0 && density <= kDensestTexelsPerMetre)) {
    return Refuse("texels_per_metre", "above 0 and at most 10000, or 0", density);
  }
  if (settings.density == DensityMode::kSignal && settings.uv == UvMode::kKeep) {
    return absl::InvalidArgumentError("density must be uniform where uv is keep: only generated charts can change");
  }
  return absl::OkStatus();
}

absl::Status CheckLight(const BakeSettings& settings) {
  if (!(settings.target_error >= 0 && settings.target_error < 1)) {
    return Refuse("target_error", "a relative error below 1, or 0", settings.target_error);
  }
  BAKEWELL_RETURN_IF_ERROR(CheckSamples("min_samples", settings.min_samples));
  BAKEWELL_RETURN_IF_ERROR(CheckSamples("max_samples", settings.max_samples));
  if (settings.max_samples != 0 && settings.min_samples > settings.max_samples) {
    return Refuse("min_samples", "at most max_samples", settings.min_samples);
  }
  if (settings.photons < 0 || settings.photons > kMostPhotons) {
    return Refuse("photons", "0 to 2^40", settings.photons);
  }
  if (settings.photon_batches < 1 || settings.photon_batches > kMostBatches) {
    return Refuse("photon_batches", "1 to 65536", settings.photon_batches);
  }
  if (!(settings.footprint > 0 && settings.footprint <= 1)) {
    return Refuse("footprint", "above 0 and at most 1", settings.footprint);
  }
  if (!(settings.albedo_limit > 0 && settings.albedo_limit <= 1)) {
    return Refuse("albedo_limit", "above 0 and at most 1", settings.albedo_limit);
  }
  return absl::OkStatus();
}

absl::Status CheckEnvironment(const Environment& environment) {
  for (const Rgb& rgb : {environment.radiance, environment.zenith, environment.horizon, environment.ground}) {
    if (IsRadiated(rgb)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("environment radiances must be finite, not negative and at most ", kMostRadiated));
  }
  for (size_t i = 0; i < environment.latlong.size(); ++i) {
    if (IsRadiated(environment.latlong[i])) continue;
    const auto width = static_cast<size_t>(environment.width);
    return absl::InvalidArgumentError(absl::StrCat("environment pixel (", i % width, ", ", i / width,
                                                   ") is negative, not finite or above ", kMostRadiated));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ValidateSettings(const BakeSettings& settings) {
  BAKEWELL_RETURN_IF_ERROR(CheckPage(settings));
  BAKEWELL_RETURN_IF_ERROR(CheckLight(settings));
  return settings.environment ? CheckEnvironment(*settings.environment) : absl::OkStatus();
}

}  // namespace bakewell
