#include <iostream>

#include "client/cli/cli.h"

// `bakewell unwrap` alone, for the bench: it links nothing that bakes.
int main(int argc, char** argv) {
  return bakewell::RunCli(argc, argv, {std::cout, std::cerr, false}, {{}, {}, bakewell::Unwrap});
}
