#pragma once

#include <filesystem>
#include <string>

#include "core/base/status.h"
#include "server/chart/options.h"

namespace CLI {
class App;
}

namespace bakewell {

// Everything `bakewell unwrap` can be asked for.
struct UnwrapRequest {
  std::filesystem::path input, output;  // .obj or .glb/.gltf, both of one kind
  std::filesystem::path picture;        // .png of the pages, charts coloured; empty: none
  chart::ChartOptions chart;
  chart::PackOptions pack;
  bool json = false;
};

// Charts and packs the input, writes the output (whole or not at all), prints one line of statistics (one JSON object
// with request.json) to stdout.
absl::Status Unwrap(const UnwrapRequest& request);

// Adds `unwrap in -o out` with every option as a flag to a CLI11 program; `exit_code` is set when it has run (0, or 2
// after an error that is printed to stderr). `exit_code` must outlive the program's parsing.
void RegisterUnwrap(CLI::App& program, int& exit_code);

}  // namespace bakewell
