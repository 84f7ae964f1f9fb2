#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/cli.h"

namespace bakewell {

// Adds submit, watch, list, cancel, fetch, estimate and workers: the commands that talk to a coordinator. Exit codes as
// of the other commands; a job that failed is 1, one that was cancelled 130. The references must outlive the parse.
void AddFarmCommands(CLI::App& app, const Console& console, int* exit_code);

}  // namespace bakewell
