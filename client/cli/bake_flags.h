#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "core/artifact/settings.h"
#include "core/base/status.h"

namespace bakewell {

// The flags of `bake` and `reference` as they were typed; absent flags leave what --settings or the default says.
struct BakeFlags {
  std::string scene;
  std::string output = "out";
  std::string settings_file;
  int threads = 0;
  bool json = false;
  int spp = 1024;  // reference only

  std::optional<std::string> uv, density, quality, backfaces, environment;
  std::optional<int> resolution, max_samples, photon_batches;
  bool no_filter = false;
  std::vector<std::string> no_skip;
  std::optional<float> texels_per_metre, target_error, albedo_limit, footprint;
  std::optional<int64_t> photons;
  std::optional<uint32_t> seed;
};

// Adds the flags that both commands have, and those that only one has. `flags` must outlive the parse.
void AddSharedFlags(CLI::App& command, BakeFlags& flags);
void AddBakeOnlyFlags(CLI::App& command, BakeFlags& flags);
void AddReferenceOnlyFlags(CLI::App& command, BakeFlags& flags);

// --settings, then the other flags over it, validated. kInvalidArgument, kNotFound: says which file or flag.
absl::StatusOr<BakeSettings> SettingsFromFlags(const BakeFlags& flags);

// threads and spp. kInvalidArgument.
absl::Status ValidateFlags(const BakeFlags& flags);

}  // namespace bakewell
