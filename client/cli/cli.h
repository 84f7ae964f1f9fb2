#pragma once

#include <functional>
#include <ostream>

#include "client/local/bake.h"

namespace bakewell {

// What the commands call to do the work; main() passes Bake and BakeReference.
struct Bakers {
  std::function<absl::StatusOr<BakeSummary>(const BakeRequest&, Progress&)> bake;
  std::function<absl::StatusOr<BakeSummary>(const ReferenceRequest&, Progress&)> reference;
};

// Where a command prints: results on `out`, progress, warnings and errors on `err`; with --json all of it on `out`,
// one object a line.
struct Console {
  std::ostream& out;
  std::ostream& err;
  bool err_is_terminal = false;
};

// Runs the command line, whose words are argv[1..argc). The exit code: 0 done, 1 failed, 2 the user's error (flags,
// files, the scene), 130 cancelled. One at a time: it takes over SIGINT and SIGTERM while a bake runs.
int RunCli(int argc, const char* const* argv, const Console& console, const Bakers& bakers);

}  // namespace bakewell
