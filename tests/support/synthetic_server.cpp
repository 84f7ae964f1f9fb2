#include "server/cli/program.h"
#include "tests/support/synthetic.h"

int main(int argc, char** argv) {
  return bakewell::RunServerProgram(argc, argv, bakewell::test::SyntheticPlanner(), {});
}
