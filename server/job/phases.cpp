#include "core/base/fields.h"
#include "server/job/types.h"

namespace bakewell::job {

std::string SerializePhases(const std::vector<PhaseView>& phases) {
  FieldWriter writer;
  writer.Put(static_cast<uint32_t>(phases.size()));
  for (const PhaseView& phase : phases) {
    writer.PutString(phase.phase);
    for (const int64_t number : {phase.done, phase.total, int64_t{phase.run.count()}, int64_t{phase.wall.count()}}) {
      writer.Put(static_cast<uint64_t>(number));
    }
  }
  return std::move(writer).bytes();
}

absl::StatusOr<std::vector<PhaseView>> ParsePhases(std::string_view bytes) {
  FieldReader reader(bytes);
  std::vector<PhaseView> phases;
  for (uint32_t left = reader.Get<uint32_t>(); left > 0 && reader.ok(); --left) {
    PhaseView phase;
    phase.phase = reader.GetString();
    phase.done = static_cast<int64_t>(reader.Get<uint64_t>());
    phase.total = static_cast<int64_t>(reader.Get<uint64_t>());
    phase.run = std::chrono::microseconds(static_cast<int64_t>(reader.Get<uint64_t>()));
    phase.wall = std::chrono::microseconds(static_cast<int64_t>(reader.Get<uint64_t>()));
    phases.push_back(std::move(phase));
  }
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("phases"));
  return phases;
}

}  // namespace bakewell::job
