// From a request to tasks that run: admission, planning, what is known already.
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/base/caught.h"
#include "core/base/check.h"
#include "server/job/coordinator.h"

namespace bakewell::job {

namespace {

// How wide the interval of an estimate is, from how bakes of one scene differ.
constexpr double kLowFactor = 0.75;
constexpr double kHighFactor = 1.6;

std::chrono::microseconds Scaled(std::chrono::microseconds time, double factor) {
  return std::chrono::microseconds(static_cast<int64_t>(static_cast<double>(time.count()) * factor));
}

}  // namespace

absl::Status Coordinator::CheckRequest(const SubmitRequest& request) {
  if (!IsPlainName(request.client_key)) {
    return absl::InvalidArgumentError("client_key must be 1 to 64 of [A-Za-z0-9_.-]");
  }
  if (!request.name.empty() && !IsPlainName(request.name)) {
    return absl::InvalidArgumentError("name must be at most 64 of [A-Za-z0-9_.-]");
  }
  if (request.settings.size() > kMaxSettingsBytes) return absl::InvalidArgumentError("settings are above 64 KiB");
  if (!blobs_->Has(request.scene)) {
    return absl::NotFoundError(absl::StrCat("scene ", request.scene.Hex(), " is not stored: upload it first"));
  }
  return absl::OkStatus();
}

absl::StatusOr<store::AccountRow> Coordinator::AccountOf(const std::string& user) {
  const std::lock_guard lock(reader_mutex_);
  BAKEWELL_ASSIGN_OR_RETURN(const auto account, reader_->FindAccount(user));
  return account.value_or(options_.defaults);
}

absl::Status Coordinator::CheckQuota(const SubmitRequest& request, const store::AccountRow& account) {
  const int64_t scene_bytes = blobs_->SizeOf(request.scene);
  if (account.max_scene_bytes > 0 && scene_bytes > account.max_scene_bytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the scene has ", scene_bytes, " bytes; ", request.user, " may submit ", account.max_scene_bytes));
  }
  const Lock lock(mutex_);
  const auto jobs =
      std::count_if(jobs_.begin(), jobs_.end(), [&](const auto& job) { return job.second.row.user == request.user; });
  if (account.max_jobs > 0 && jobs >= account.max_jobs) {
    return absl::ResourceExhaustedError(
        absl::StrCat(request.user, " has ", jobs, " jobs running, which is the limit: wait for one to end"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::optional<store::KnownTask>> Coordinator::FindUsable(const TaskKey& key) {
  std::optional<store::KnownTask> known;
  {
    const std::lock_guard lock(reader_mutex_);
    BAKEWELL_ASSIGN_OR_RETURN(known, reader_->FindKnown(key));
  }
  if (!known) return known;
  const bool whole = std::all_of(known->outputs.begin(), known->outputs.end(),
                                 [&](const TaskOutput& output) { return blobs_->Has(output.digest); });
  if (whole) return known;
  // A result whose bytes were lost is not known any more.
  writer_->Submit([key](store::Tables& tables) { return tables.DeleteKnown(key); });
  return std::optional<store::KnownTask>();
}

absl::StatusOr<Stage> Coordinator::LookUp(plan::TaskGraph graph) {
  constexpr int64_t kTouchEveryUs = 600'000'000;
  Stage stage;
  std::vector<TaskKey> touched;
  for (const plan::PlannedTask& task : graph.tasks) {
    BAKEWELL_ASSIGN_OR_RETURN(const auto known, FindUsable(task.key));
    stage.known.push_back(known ? std::optional(known->outputs) : std::nullopt);
    if (known && known->used_us < WallNowUs() - kTouchEveryUs) touched.push_back(task.key);
  }
  if (!touched.empty()) {
    writer_->Submit([touched, now_us = WallNowUs()](store::Tables& tables) -> absl::Status {
      for (const TaskKey& key : touched) BAKEWELL_RETURN_IF_ERROR(tables.TouchKnown(key, now_us));
      return absl::OkStatus();
    });
  }
  stage.graph = std::move(graph);
  return stage;
}

// Plans from where `stages` ends, for as long as the next stage depends on what is known. `gate`: the outputs that the
// first of them waits for, where the caller has them.
absl::StatusOr<std::vector<Stage>> Coordinator::PlanKnown(const plan::PlanRequest& request,
                                                          std::vector<plan::TaskGraph> stages,
                                                          std::optional<TaskOutputs> gate) {
  const plan::BlobReader blobs_reader = [this](const Digest& digest) { return blobs_->Get(digest); };
  std::vector<Stage> planned;
  if (stages.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(plan::TaskGraph graph, planner_.Plan(request, blobs_reader));
    BAKEWELL_RETURN_IF_ERROR(plan::CheckGraph(graph, stages));
    stages.push_back(graph);
    BAKEWELL_ASSIGN_OR_RETURN(Stage stage, LookUp(std::move(graph)));
    planned.push_back(std::move(stage));
  }
  while (stages.back().next_stage_after) {
    if (!gate) {
      BAKEWELL_ASSIGN_OR_RETURN(const auto known, FindUsable(*stages.back().next_stage_after));
      if (!known) break;
      gate = known->outputs;
    }
    BAKEWELL_ASSIGN_OR_RETURN(plan::TaskGraph graph, planner_.Continue(request, stages, *gate, blobs_reader));
    gate.reset();
    BAKEWELL_RETURN_IF_ERROR(plan::CheckGraph(graph, stages));
    stages.push_back(graph);
    BAKEWELL_ASSIGN_OR_RETURN(Stage stage, LookUp(std::move(graph)));
    planned.push_back(std::move(stage));
  }
  return planned;
}

namespace {

absl::StatusOr<SubmitResult> SameJob(const store::JobRow& row, const SubmitRequest& request) {
  if (row.scene == request.scene && row.settings == request.settings) return SubmitResult{row.id, true};
  return absl::AlreadyExistsError(absl::StrCat("client_key ", request.client_key, " is job ", row.id,
                                               ", of another scene or settings: make a new key"));
}

}  // namespace

absl::StatusOr<SubmitResult> Coordinator::Submit(const SubmitRequest& request) {
  BAKEWELL_RETURN_IF_ERROR(CheckRequest(request));
  const auto find_same = [&]() -> absl::StatusOr<std::optional<store::JobRow>> {
    const std::lock_guard lock(reader_mutex_);
    return reader_->FindJobByKey(request.user, request.client_key);
  };
  BAKEWELL_ASSIGN_OR_RETURN(const auto same, find_same());
  if (same) return SameJob(*same, request);
  BAKEWELL_ASSIGN_OR_RETURN(const store::AccountRow account, AccountOf(request.user));
  BAKEWELL_RETURN_IF_ERROR(CheckQuota(request, account));

  // From here until the job is active, nothing that is known may be collected.
  const store::CollectGate::Hold hold = collector_.gate().Enter();
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<Stage> stages, PlanKnown({request.scene, request.settings}, {}, {}));
  store::JobRow row;
  row.user = request.user;
  row.client_key = request.client_key;
  row.name = request.name;
  row.priority = request.priority;
  row.scene = request.scene;
  row.settings = request.settings;
  row.submitted_us = WallNowUs();
  for (const Stage& stage : stages) row.tasks += static_cast<int64_t>(stage.graph.tasks.size());
  if (account.max_tasks > 0 && row.tasks > account.max_tasks) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the job has ", row.tasks, " tasks; ", request.user, " may have ", account.max_tasks));
  }
  {
    const Lock lock(mutex_);
    row.id = next_job_++;
  }
  std::vector<std::string> graphs;
  for (const Stage& stage : stages) graphs.push_back(plan::SerializeGraph(stage.graph));
  const absl::Status written = writer_->TryRun([&](store::Tables& tables) -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(tables.InsertJob(row).status());
    for (size_t i = 0; i < graphs.size(); ++i) {
      BAKEWELL_RETURN_IF_ERROR(tables.InsertStage(row.id, static_cast<int64_t>(i), graphs[i]));
    }
    return absl::OkStatus();
  });
  if (absl::IsAlreadyExists(written)) {  // the same submit came twice at a time
    BAKEWELL_ASSIGN_OR_RETURN(const auto first, find_same());
    if (first) return SameJob(*first, request);
  }
  BAKEWELL_RETURN_IF_ERROR(written);
  Activate(row, account.weight, std::move(stages));
  return SubmitResult{row.id, false};
}

absl::StatusOr<Estimate> Coordinator::EstimateCost(const SubmitRequest& request) {
  BAKEWELL_RETURN_IF_ERROR(CheckRequest(request));
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<Stage> stages, PlanKnown({request.scene, request.settings}, {}, {}));
  Estimate estimate;
  std::chrono::microseconds run{0};
  const Lock lock(mutex_);
  for (const Stage& stage : stages) {
    for (size_t i = 0; i < stage.graph.tasks.size(); ++i) {
      const plan::PlannedTask& task = stage.graph.tasks[i];
      ++estimate.tasks;
      estimate.memory_bytes = std::max(estimate.memory_bytes, task.memory_bytes);
      if (stage.known[i]) {
        ++estimate.tasks_known;
        continue;
      }
      const int kind = costs_.KindOf(task.spec);
      run += Scaled(task.cost, kind < 0 ? 1 : costs_.RunRatio(kind));
    }
  }
  estimate.run_low = Scaled(run, kLowFactor);
  estimate.run_high = Scaled(run, kHighFactor);
  estimate.complete = !stages.back().graph.next_stage_after;
  return estimate;
}

void Coordinator::Activate(const store::JobRow& row, int64_t weight, std::vector<Stage> stages) {
  const Lock lock(mutex_);
  Job& job = jobs_[row.id];
  job.row = row;
  job.row.tasks = job.row.known_tasks = 0;
  sched_.AddJob(sched::JobId{row.id}, {row.user, row.priority, weight, true});
  for (Stage& stage : stages) AddStage(job, std::move(stage));
  if (!job.stages.empty() && job.stages.back().next_stage_after) {
    const TaskId gate = by_key_.at(*job.stages.back().next_stage_after);
    if (TaskOf(gate).done) ContinueLater(row.id);
  } else {
    sched_.CloseJob(sched::JobId{row.id});
  }
  HandleEvents();
  Dispatch();
}

void Coordinator::AddStage(Job& job, Stage stage) {
  for (size_t i = 0; i < stage.graph.tasks.size(); ++i) AddTask(job, stage.graph.tasks[i], stage.known[i]);
  job.row.tasks += static_cast<int64_t>(stage.graph.tasks.size());
  job.stages.push_back(std::move(stage.graph));
  // Continue() gets the graphs back with their specs; keys and artifacts are what the job itself needs.
  if (!job.stages.back().next_stage_after) {
    for (plan::PlannedTask& task : job.stages.back().tasks) task.spec = {};
  }
  job.changed = true;
}

Coordinator::TaskId Coordinator::AddTask(Job& job, const plan::PlannedTask& planned,
                                         const std::optional<TaskOutputs>& known) {
  const sched::JobId sched_job{job.row.id};
  Phase& phase = job.phases[planned.spec.kind];
  ++phase.total;
  if (const auto found = by_key_.find(planned.key); found != by_key_.end()) {
    Task& task = TaskOf(found->second);
    if (std::find(task.jobs.begin(), task.jobs.end(), job.row.id) != task.jobs.end()) {
      --phase.total;  // the planner named it twice
      --job.row.tasks;
      return found->second;
    }
    task.jobs.push_back(job.row.id);
    sched_.JoinTask(sched_job, found->second);
    if (task.done) AddPreviews(task.outputs, job);
    if (task.done)
      ++phase.done, ++job.tasks_done, ++job.row.known_tasks;
    else
      phase.left += task.cost;
    return found->second;
  }
  // A graph from before an upgrade may have a version that nobody runs now: its task waits for a worker that has it.
  const int kind = costs_.KindOf(planned.spec), capability = kind < 0 ? 63 : kind;
  sched::TaskInfo info{capability, next_order_++, planned.cost, planned.memory_bytes, {}, known.has_value()};
  for (const TaskInput& input : planned.spec.inputs) {
    const OutputOf* made = std::get_if<OutputOf>(&input.source);
    if (made != nullptr) info.needs.push_back(by_key_.at(made->task));
  }
  std::sort(info.needs.begin(), info.needs.end());
  info.needs.erase(std::unique(info.needs.begin(), info.needs.end()), info.needs.end());
  const TaskId id = sched_.AddTask(sched_job, info);
  if (static_cast<size_t>(id) >= tasks_.size()) tasks_.resize(static_cast<size_t>(id) + 1);
  TaskOf(id) = Task{planned.key,       planned.spec, known.value_or(TaskOutputs{}), planned.memory_bytes, planned.cost,
                    known.has_value(), {job.row.id}};
  by_key_[planned.key] = id;
  if (known) AddPreviews(*known, job);
  if (known)
    ++phase.done, ++job.tasks_done, ++job.row.known_tasks, ++stats_.known;
  else
    phase.left += planned.cost;
  return id;
}

void Coordinator::ContinueLater(int64_t id) {
  io_.Post([this, id] {
    const absl::Status status = Caught([&] { return ContinueJob(id); });
    if (!status.ok()) AddStages(id, status);
  });
}

// Plans the next stages and asks for them to be written; no thread waits for the disk, which may be full for hours.
absl::Status Coordinator::ContinueJob(int64_t id) {
  plan::PlanRequest request;
  std::vector<plan::TaskGraph> stages;
  TaskOutputs gate;
  {
    const Lock lock(mutex_);
    const auto job = jobs_.find(id);
    if (job == jobs_.end() || job->second.ending) return absl::OkStatus();
    request = {job->second.row.scene, job->second.row.settings};
    stages = job->second.stages;
    const Task& gate_task = TaskOf(by_key_.at(*stages.back().next_stage_after));
    if (!gate_task.done) return absl::OkStatus();  // lost meanwhile; comes again when it is
    gate = gate_task.outputs;
  }
  const store::CollectGate::Hold hold = collector_.gate().Enter();  // until the stages are part of the job
  const size_t first = stages.size();
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<Stage> known, PlanKnown(request, std::move(stages), gate));
  std::vector<std::string> graphs;
  for (const Stage& stage : known) graphs.push_back(plan::SerializeGraph(stage.graph));
  const auto write = [id, first, graphs = std::move(graphs)](store::Tables& tables) -> absl::Status {
    for (size_t i = 0; i < graphs.size(); ++i) {
      BAKEWELL_RETURN_IF_ERROR(tables.InsertStage(id, static_cast<int64_t>(first + i), graphs[i]));
    }
    return absl::OkStatus();
  };
  const auto planned = std::make_shared<std::vector<Stage>>(std::move(known));
  writer_->Submit(write, [this, id, planned, hold](const absl::Status& written) {
    io_.Post([this, id, planned, hold, written] {
      if (written.ok())
        AddStages(id, std::move(*planned));
      else
        AddStages(id, written);
    });
  });
  return absl::OkStatus();
}

// Goes on with them, or ends the job if there are none.
void Coordinator::AddStages(int64_t id, absl::StatusOr<std::vector<Stage>> stages) {
  const Lock lock(mutex_);
  const auto job = jobs_.find(id);
  if (job == jobs_.end() || job->second.ending) return;
  if (stages.ok()) {
    for (Stage& stage : *stages) AddStage(job->second, std::move(stage));
    if (!job->second.stages.back().next_stage_after) sched_.CloseJob(sched::JobId{id});
  } else {
    EndJob(id, store::JobState::kFailed, stages.status(), {});
  }
  HandleEvents();
  Dispatch();
}

}  // namespace bakewell::job
