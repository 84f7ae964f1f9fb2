#include "client/cli/bake_flags.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <filesystem>
#include <map>

#include "client/cli/environment.h"
#include "core/artifact/atomic_file.h"
#include "proto/settings.h"

namespace bakewell {
namespace {

const std::map<std::string, UvMode>& UvNames() {
  static const std::map<std::string, UvMode> names = {
      {"auto", UvMode::kAuto}, {"generate", UvMode::kGenerate}, {"keep", UvMode::kKeep}};
  return names;
}

const std::map<std::string, DensityMode>& DensityNames() {
  static const std::map<std::string, DensityMode> names = {{"signal", DensityMode::kSignal},
                                                           {"uniform", DensityMode::kUniform}};
  return names;
}

const std::map<std::string, Quality>& QualityNames() {
  static const std::map<std::string, Quality> names = {
      {"high", Quality::kHigh}, {"medium", Quality::kMedium}, {"preview", Quality::kPreview}};
  return names;
}

const std::map<std::string, BackfaceMode>& BackfaceNames() {
  static const std::map<std::string, BackfaceMode> names = {
      {"absorb", BackfaceMode::kAbsorb}, {"pass", BackfaceMode::kPass}, {"reflect", BackfaceMode::kReflect}};
  return names;
}

// Accepts the map's names only.
template <typename T>
CLI::IsMember OneOf(const std::map<std::string, T>& names) {
  std::vector<std::string> words;
  for (const auto& [word, value] : names) words.push_back(word);
  return CLI::IsMember(words);
}

absl::StatusOr<BakeSettings> BaseSettings(const std::string& file) {
  if (file.empty()) return BakeSettings();
  BAKEWELL_ASSIGN_OR_RETURN(const std::string json, ReadWholeFile(file));
  // A picture is named relative to the settings that name it.
  const auto read_latlong = [&](const std::string& picture) {
    return ReadLatLong(std::filesystem::path(file).parent_path() / picture);
  };
  absl::StatusOr<BakeSettings> settings = SettingsFromJson(json, read_latlong);
  if (settings.ok()) return settings;
  return absl::Status(settings.status().code(), absl::StrCat(file, ": ", settings.status().message()));
}

}  // namespace

void AddSharedFlags(CLI::App& command, BakeFlags& flags) {
  command.add_option("scene", flags.scene, "The level, glTF 2.0: .glb or .gltf")->required();
  command.add_option("-o,--output", flags.output, "Folder for the results")->capture_default_str();
  command.add_option("--settings", flags.settings_file, "Settings as a JSON file; the other flags override it");
  command.add_option("--uv", flags.uv, "keep TEXCOORD_1, generate charts, or auto: keep where all have it")
      ->check(OneOf(UvNames()));
  command
      .add_option("--density", flags.density,
                  "Of generated charts: uniform, or signal: finer where a preview of the light changes, coarser where "
                  "it does not, with as many texels")
      ->check(OneOf(DensityNames()));
  command.add_option("--resolution", flags.resolution, "Side of a page in texels");
  command.add_option("--texels-per-metre", flags.texels_per_metre, "Density; pages follow");
  command.add_option("--backfaces", flags.backfaces, "What back faces do to light")->check(OneOf(BackfaceNames()));
  command.add_option("--environment", flags.environment,
                     "none, constant:R,G,B, gradient:R,G,B/R,G,B/R,G,B (zenith/horizon/ground) or FILE.exr "
                     "(latitude-longitude), instead of the scene's");
  command.add_option("--albedo-limit", flags.albedo_limit, "Largest albedo; above it is clamped (0.98)");
  command.add_flag("--no-filter", flags.no_filter, "Leave the noise as it is");
  command.add_option("--footprint", flags.footprint, "Side of the square that a texel averages, in texels (0.5)");
  command.add_option("--seed", flags.seed, "Another seed, other noise");
  command.add_option("--threads", flags.threads, "Threads; 0: as many as the machine has")->capture_default_str();
  command.add_flag("--json", flags.json, "One JSON object a line on standard output");
}

void AddBakeOnlyFlags(CLI::App& command, BakeFlags& flags) {
  command.add_option("--quality", flags.quality, "Noise against time (medium)")->check(OneOf(QualityNames()));
  command.add_option("--target-error", flags.target_error, "Relative error that the bake is to come to, about: 0.02");
  command.add_option("--samples", flags.max_samples, "Most gather rays a texel, a power of two");
  command.add_option("--photons", flags.photons,
                     "Photons to emit; without it as many as the error that is asked for needs");
  command
      .add_option("--no-skip", flags.no_skip,
                  "Compute what seems not to matter, too: all, or some of " + absl::StrJoin(kSkipNames, ", "))
      ->delimiter(',');
  command.add_option("--photon-batches", flags.photon_batches, "Tasks that the photons are split into (8)");
}

void AddReferenceOnlyFlags(CLI::App& command, BakeFlags& flags) {
  command.add_option("--spp", flags.spp, "Paths a texel")->capture_default_str();
}

absl::StatusOr<BakeSettings> SettingsFromFlags(const BakeFlags& flags) {
  BAKEWELL_ASSIGN_OR_RETURN(BakeSettings settings, BaseSettings(flags.settings_file));
  if (flags.uv) settings.uv = UvNames().at(*flags.uv);
  if (flags.density) settings.density = DensityNames().at(*flags.density);
  if (flags.quality) settings.quality = QualityNames().at(*flags.quality);
  if (flags.backfaces) settings.backfaces = BackfaceNames().at(*flags.backfaces);
  settings.resolution = flags.resolution.value_or(settings.resolution);
  settings.texels_per_metre = flags.texels_per_metre.value_or(settings.texels_per_metre);
  settings.target_error = flags.target_error.value_or(settings.target_error);
  settings.max_samples = flags.max_samples.value_or(settings.max_samples);
  settings.photons = flags.photons.value_or(settings.photons);
  settings.photon_batches = flags.photon_batches.value_or(settings.photon_batches);
  settings.albedo_limit = flags.albedo_limit.value_or(settings.albedo_limit);
  settings.footprint = flags.footprint.value_or(settings.footprint);
  settings.filter = settings.filter && !flags.no_filter;
  settings.seed = flags.seed.value_or(settings.seed);
  if (!flags.no_skip.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(settings.no_skip, SkipSetOf(flags.no_skip));
  }
  if (flags.environment) {
    BAKEWELL_ASSIGN_OR_RETURN(settings.environment, ParseEnvironment(*flags.environment));
  }
  BAKEWELL_RETURN_IF_ERROR(ValidateSettings(settings));
  return settings;
}

absl::Status ValidateFlags(const BakeFlags& flags) {
  constexpr int kMostThreads = 1024;
  constexpr int kMostPaths = 1 << 24;
  if (flags.threads < 0 || flags.threads > kMostThreads) {
    return absl::InvalidArgumentError(absl::StrCat("--threads must be 0 to 1024, not ", flags.threads));
  }
  if (flags.spp < 1 || flags.spp > kMostPaths) {
    return absl::InvalidArgumentError(absl::StrCat("--spp must be 1 to 16777216, not ", flags.spp));
  }
  return absl::OkStatus();
}

}  // namespace bakewell
