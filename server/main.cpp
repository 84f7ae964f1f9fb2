#include "core/artifact/level_task.h"
#include "server/chart/choose.h"
#include "server/cli/program.h"
#include "server/plan/level_planner.h"

namespace bakewell {
namespace {

absl::StatusOr<std::vector<job::LocalBlob>> RunChart(const TaskSpec& spec, const std::vector<std::string>& inputs) {
  if (inputs.size() != 1) return absl::InvalidArgumentError("chart/layout has one input, the scene");
  BAKEWELL_ASSIGN_OR_RETURN(std::string layout, RunChartTask(spec.settings, inputs[0]));
  return std::vector<job::LocalBlob>{{"layout", std::move(layout)}};
}

}  // namespace
}  // namespace bakewell

int main(int argc, char** argv) {
  using bakewell::level_task::kChart;
  const bakewell::plan::LevelPlanner planner;
  return bakewell::RunServerProgram(argc, argv, planner, {{{kChart.kind, kChart.code_version}, bakewell::RunChart}});
}
