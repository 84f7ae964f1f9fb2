#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/cli.h"

namespace bakewell {

// Adds `admin` with what an operator does: status, drain, priority, quota, gc. Needs a token with scope admin where the
// coordinator has tokens. The references must outlive the parse.
void AddAdminCommand(CLI::App& app, const Console& console, int* exit_code);

}  // namespace bakewell
