#include "server/job/learnt_costs.h"

#include <algorithm>
#include <cmath>

namespace bakewell::job {

void CostRatio::Add(double ratio) {
  constexpr double kLeast = 0.01, kMost = 100, kLastStep = 0.05;
  ratio = std::clamp(ratio, kLeast, kMost);
  const double step = std::max(kLastStep, 1 / static_cast<double>(samples + 1));
  value = samples == 0 ? ratio : value * std::exp(std::clamp(std::log(ratio / value), -step, step));
  ++samples;
}

int LearntCosts::KindOf(const TaskSpec& spec) const {
  const auto kind = std::find(kinds_.begin(), kinds_.end(), plan::Kind{spec.kind, spec.code_version});
  return kind == kinds_.end() ? -1 : static_cast<int>(kind - kinds_.begin());
}

absl::Status LearntCosts::Load(store::Tables& tables, const std::function<void(int, double)>& tell) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<store::CostRow> rows, tables.Costs());
  for (const store::CostRow& row : rows) {
    const auto kind = std::find(kinds_.begin(), kinds_.end(), plan::Kind{row.kind, row.code_version});
    if (kind == kinds_.end()) continue;
    run_[static_cast<size_t>(kind - kinds_.begin())] = {row.run_ratio, row.samples};
    tell(static_cast<int>(kind - kinds_.begin()), row.lease_ratio);
  }
  return absl::OkStatus();
}

void LearntCosts::Learn(int kind, double ratio, double lease_ratio, store::Writer& writer) {
  constexpr int64_t kAllOf = 8, kOneIn = 16;
  CostRatio& run = run_.at(static_cast<size_t>(kind));
  run.Add(ratio);
  if (run.samples > kAllOf && run.samples % kOneIn != 0) return;
  const plan::Kind& name = kinds_[static_cast<size_t>(kind)];
  const store::CostRow row{name.kind, name.code_version, run.value, lease_ratio, run.samples};
  writer.Submit([row](store::Tables& tables) { return tables.PutCost(row); });
}

}  // namespace bakewell::job
