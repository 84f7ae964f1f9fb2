#include "server/cli/program.h"
#include "server/level/chart_task.h"
#include "server/plan/level_planner.h"

int main(int argc, char** argv) {
  const bakewell::plan::LevelPlanner planner;
  return bakewell::RunServerProgram(argc, argv, planner, bakewell::ChartTasks());
}
