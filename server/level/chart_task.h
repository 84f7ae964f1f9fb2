#pragma once

#include "server/job/local_runner.h"

namespace bakewell {

struct ChartOptions {
  std::function<void()> begins, ends;  // called around each task
  std::string layout;                  // SerializeLayout bytes: charts that are there already, for one job; empty: made
};

// The task of a bake that the coordinator runs itself: chart/layout.
job::LocalTasks ChartTasks(const ChartOptions& options = {});

}  // namespace bakewell
