#pragma once

#include "server/job/local_runner.h"
#include "server/plan/plan.h"

namespace bakewell {

// The program bakewell-server: serves a planner's jobs, makes tokens and backups. argv as main() has it. Exit codes: 0
// done, 1 failed, 2 wrong flags. `local`: kinds of tasks that the coordinator runs itself; may be empty.
int RunServerProgram(int argc, char** argv, const plan::Planner& planner, const job::LocalTasks& local);

}  // namespace bakewell
