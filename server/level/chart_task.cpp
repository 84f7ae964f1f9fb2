#include "server/level/chart_task.h"

#include "core/artifact/level_task.h"
#include "server/chart/choose.h"

namespace bakewell {

job::LocalTasks ChartTasks(const ChartOptions& options) {
  const auto run = [options](const TaskSpec& spec,
                             const std::vector<std::string>& inputs) -> absl::StatusOr<std::vector<job::LocalBlob>> {
    if (inputs.size() != 1) return absl::InvalidArgumentError("chart/layout has one input, the scene");
    if (options.begins) options.begins();
    std::string layout = options.layout;
    if (layout.empty()) {
      BAKEWELL_ASSIGN_OR_RETURN(layout, RunChartTask(spec.settings, inputs[0]));
    }
    if (options.ends) options.ends();
    return std::vector<job::LocalBlob>{{"layout", std::move(layout)}};
  };
  const plan::Kind kind{level_task::kChart.kind, level_task::kChart.code_version};
  job::LocalTasks tasks(1);
  tasks[0] = job::LocalKind{kind, run};
  return tasks;
}

}  // namespace bakewell
