#pragma once

#include <vector>

#include "server/plan/plan.h"
#include "server/store/tables.h"
#include "server/store/writer.h"

namespace bakewell::job {

// What tasks of a kind take over what their planner thought, as a running median that neither a stuck machine nor a
// lying worker can move far: each sample moves it by its logarithm's difference, at most by a step that shrinks from
// 100 to 5 %. Between 0.01 and 100; 1 before the first sample.
struct CostRatio {
  double value = 1;
  int64_t samples = 0;
  void Add(double ratio);
};

// The ratios of all kinds, kept in the database, so that the first estimate after a restart is as good as the last one
// before it. They decide no task's size or key: a second submit has the keys of the first. The owner serialises calls.
class LearntCosts {
 public:
  explicit LearntCosts(const std::vector<plan::Kind>& kinds) : kinds_(kinds), run_(kinds.size()) {}
  // Index into the kinds, or -1: of a version that this program does not plan.
  int KindOf(const TaskSpec& spec) const;
  // What was learnt before, of the kinds and versions that there are.
  absl::Status Load(store::Tables& tables, const std::function<void(int kind, double lease_ratio)>& tell);
  // A completion. `lease_ratio`: the scheduler's, kept with it. Written at times: a crash forgets a few samples.
  void Learn(int kind, double ratio, double lease_ratio, store::Writer& writer);
  double RunRatio(int kind) const { return run_.at(static_cast<size_t>(kind)).value; }

 private:
  const std::vector<plan::Kind> kinds_;
  std::vector<CostRatio> run_;  // by kind
};

}  // namespace bakewell::job
