#include <absl/container/flat_hash_set.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/plan/plan.h"

namespace bakewell::plan {

namespace {

constexpr uint32_t kGraphFormat = 1;

absl::Status Broken(const std::string& what) { return absl::InternalError(absl::StrCat("planner: ", what)); }

absl::Status CheckTask(const PlannedTask& task, const absl::flat_hash_set<TaskKey, TaskKeyHash>& known) {
  if (task.key != KeyOf(task.spec)) return Broken(absl::StrCat("key of a ", task.spec.kind, " is not its spec's"));
  if (!IsPlainPath(task.spec.kind)) return Broken(absl::StrCat("kind '", task.spec.kind, "' is not plain"));
  for (const TaskInput& input : task.spec.inputs) {
    const OutputOf* made = std::get_if<OutputOf>(&input.source);
    if (made != nullptr && !known.contains(made->task)) {
      return Broken(absl::StrCat(task.spec.kind, " needs ", input.name, " of a task that does not come before it"));
    }
  }
  return absl::OkStatus();
}

void WriteArtifacts(const TaskGraph& graph, FieldWriter& writer) {
  writer.Put(static_cast<uint32_t>(graph.artifacts.size()));
  for (const PlannedArtifact& artifact : graph.artifacts) {
    writer.PutString(artifact.name);
    writer.PutDigest(artifact.source.task.digest);
    writer.PutString(artifact.source.output);
  }
  writer.Put(static_cast<uint32_t>(graph.deliver.size()));
  for (const TaskKey& key : graph.deliver) writer.PutDigest(key.digest);
}

void ReadArtifacts(FieldReader& reader, TaskGraph& graph) {
  for (uint32_t left = reader.Get<uint32_t>(); left > 0 && reader.ok(); --left) {
    PlannedArtifact artifact;
    artifact.name = reader.GetString();
    artifact.source.task.digest = reader.GetDigest();
    artifact.source.output = reader.GetString();
    graph.artifacts.push_back(std::move(artifact));
  }
  for (uint32_t left = reader.Get<uint32_t>(); left > 0 && reader.ok(); --left) {
    graph.deliver.push_back(TaskKey{reader.GetDigest()});
  }
}

PlannedTask ReadTask(FieldReader& reader) {
  PlannedTask task;
  task.spec = ReadSpec(reader);
  task.key = KeyOf(task.spec);
  task.cost = std::chrono::microseconds(reader.Get<uint64_t>());
  task.memory_bytes = static_cast<int64_t>(reader.Get<uint64_t>());
  return task;
}

}  // namespace

absl::Status CheckGraph(const TaskGraph& graph, const std::vector<TaskGraph>& so_far) {
  absl::flat_hash_set<TaskKey, TaskKeyHash> known;
  for (const TaskGraph& stage : so_far) {
    for (const PlannedTask& task : stage.tasks) known.insert(task.key);
  }
  for (const PlannedTask& task : graph.tasks) {
    BAKEWELL_RETURN_IF_ERROR(CheckTask(task, known));
    known.insert(task.key);
  }
  for (const PlannedArtifact& artifact : graph.artifacts) {
    if (!IsPlainPath(artifact.name)) return Broken(absl::StrCat("artifact '", artifact.name, "' is not a plain path"));
    if (!known.contains(artifact.source.task)) return Broken(absl::StrCat(artifact.name, ": made by no task"));
  }
  const auto is_known = [&](const TaskKey& key) { return known.contains(key); };
  if (!std::all_of(graph.deliver.begin(), graph.deliver.end(), is_known)) return Broken("delivers an unknown task");
  if (graph.next_stage_after && !is_known(*graph.next_stage_after)) return Broken("next stage after an unknown task");
  if (known.size() > kMaxTasksPerJob) {
    return absl::ResourceExhaustedError(absl::StrCat("the scene needs ", known.size(), " tasks; at most ",
                                                     kMaxTasksPerJob, " are allowed: lower the resolution"));
  }
  return absl::OkStatus();
}

std::string SerializeGraph(const TaskGraph& graph) {
  FieldWriter writer;
  writer.Put(kGraphFormat);
  writer.Put(static_cast<uint32_t>(graph.tasks.size()));
  for (const PlannedTask& task : graph.tasks) {
    WriteSpec(task.spec, writer);
    writer.Put(static_cast<uint64_t>(task.cost.count()));
    writer.Put(static_cast<uint64_t>(task.memory_bytes));
  }
  WriteArtifacts(graph, writer);
  writer.Put(static_cast<uint8_t>(graph.next_stage_after.has_value()));
  if (graph.next_stage_after) writer.PutDigest(graph.next_stage_after->digest);
  return std::move(writer).bytes();
}

absl::StatusOr<TaskGraph> ParseGraph(std::string_view bytes) {
  FieldReader reader(bytes);
  TaskGraph graph;
  if (reader.Get<uint32_t>() != kGraphFormat) return absl::DataLossError("task graph: unknown format");
  for (uint32_t left = reader.Get<uint32_t>(); left > 0 && reader.ok(); --left) graph.tasks.push_back(ReadTask(reader));
  ReadArtifacts(reader, graph);
  if (reader.Get<uint8_t>() != 0) graph.next_stage_after = TaskKey{reader.GetDigest()};
  BAKEWELL_RETURN_IF_ERROR(reader.Finish("task graph"));
  return graph;
}

}  // namespace bakewell::plan
