#pragma once

#include <functional>
#include <memory>

#include "worker/task/executor.h"

namespace bakewell {

// Makes the executor of a worker that uses that many threads.
using MakeExecutor = std::function<std::unique_ptr<TaskExecutor>(int threads)>;

// The program bakewell-worker: works for a coordinator until SIGTERM, --once or --idle-exit. Exit codes: 0 done, 1
// refused by the coordinator, 2 wrong flags.
int RunWorkerProgram(int argc, char** argv, const MakeExecutor& make_executor);

}  // namespace bakewell
