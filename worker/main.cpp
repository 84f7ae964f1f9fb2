#include "worker/cli/program.h"
#include "worker/level/executor.h"

int main(int argc, char** argv) {
  return bakewell::RunWorkerProgram(argc, argv, [](int threads) {
    return std::make_unique<bakewell::LevelExecutor>(bakewell::LevelExecutorOptions{.process_threads = threads});
  });
}
