#include <CLI/CLI.hpp>

#include "client/local/unwrap.h"

// `bakewell unwrap` alone, for the bench.
int main(int argc, char** argv) {
  CLI::App program("bakewell unwrap");
  int exit_code = 0;
  bakewell::RegisterUnwrap(program, exit_code);
  program.require_subcommand(1);
  CLI11_PARSE(program, argc, argv);
  return exit_code;
}
