#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/cli.h"

namespace bakewell {

// Each adds a subcommand whose callback runs it and writes *exit_code. The references must outlive the parse.
void AddBakeCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code);
void AddReferenceCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code);
void AddCompareCommand(CLI::App& app, const Console& console, int* exit_code);
void AddUnwrapCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code);

enum class OutputForm { kText, kJson };

// What a bake did and took, as --json says: text, or a line with "event": "done".
void PrintSummary(const BakeSummary& summary, OutputForm form, const Console& console);

// Prints the error once, where --json says, and returns the exit code that it means.
int ReportError(const absl::Status& status, OutputForm form, const Console& console);

}  // namespace bakewell
