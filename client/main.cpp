#include <unistd.h>

#include <iostream>

#include "client/cli/cli.h"
#include "client/local/bake.h"

int main(int argc, char** argv) {
  const bakewell::Console console{std::cout, std::cerr, ::isatty(STDERR_FILENO) == 1};
  const bakewell::Bakers bakers{bakewell::Bake, bakewell::BakeReference};
  return bakewell::RunCli(argc, argv, console, bakers);
}
