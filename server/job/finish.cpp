// How jobs look to clients, and how they end.
#include <absl/strings/str_cat.h>

#include <future>
#include <set>
#include <utility>

#include <algorithm>

#include "core/artifact/level_task.h"
#include "server/job/coordinator.h"

namespace bakewell::job {

namespace {

std::chrono::microseconds Scaled(std::chrono::microseconds time, double factor) {
  return std::chrono::microseconds(static_cast<int64_t>(static_cast<double>(time.count()) * factor));
}

const TaskOutput* FindOutput(const TaskOutputs& outputs, std::string_view name) {
  const auto found =
      std::find_if(outputs.begin(), outputs.end(), [&](const TaskOutput& output) { return output.name == name; });
  return found == outputs.end() ? nullptr : &*found;
}

JobView ViewOfRow(const store::JobRow& row) {
  JobView view;
  view.row = row;
  view.tasks_done = row.state == store::JobState::kDone ? row.tasks : 0;
  view.artifacts = ParseOutputs(row.artifacts).value_or(TaskOutputs{});
  view.phases = ParsePhases(row.phases).value_or(std::vector<PhaseView>{});
  return view;
}

std::vector<PhaseView> PhasesOf(const Job& job) {
  std::vector<PhaseView> phases;
  for (const auto& [phase, progress] : job.phases) {
    const sched::Time wall =
        progress.began ? std::max(sched::Time(0), progress.ended - *progress.began) : sched::Time(0);
    phases.push_back({phase, progress.done, progress.total, progress.run, wall});
  }
  return phases;
}

}  // namespace

TaskOutputs Coordinator::ArtifactsOf(const Job& job) const {
  TaskOutputs artifacts;
  for (const plan::TaskGraph& stage : job.stages) {
    for (const plan::PlannedArtifact& artifact : stage.artifacts) {
      const Task& task = TaskOf(by_key_.at(artifact.source.task));
      const TaskOutput* output = task.done ? FindOutput(task.outputs, artifact.source.output) : nullptr;
      if (output != nullptr) artifacts.push_back({artifact.name, output->digest, output->size_bytes});
    }
    for (const TaskKey& key : stage.deliver) {
      const Task& task = TaskOf(by_key_.at(key));
      if (task.done) artifacts.insert(artifacts.end(), task.outputs.begin(), task.outputs.end());
    }
  }
  return artifacts;
}

void AddPreviews(const TaskOutputs& outputs, Job& job) {
  for (const TaskOutput& output : outputs) {
    if (output.name.starts_with(level_task::kPreviewPrefix)) job.previews[output.name].push_back(output.digest);
  }
}

absl::StatusOr<std::vector<Digest>> Coordinator::PreviewParts(int64_t id, std::string_view picture, size_t first) {
  const Lock lock(mutex_);
  const auto job = jobs_.find(id);
  if (job == jobs_.end()) return absl::NotFoundError(absl::StrCat("job ", id, " does not run"));
  const auto parts = job->second.previews.find(picture);
  if (parts == job->second.previews.end()) {
    return absl::NotFoundError(absl::StrCat("job ", id, " has no picture '", std::string(picture), "' (yet)"));
  }
  const std::vector<Digest>& all = parts->second;
  return std::vector<Digest>(all.begin() + static_cast<ptrdiff_t>(std::min(first, all.size())), all.end());
}

JobView Coordinator::ViewOf(const Job& job) const {
  JobView view;
  view.row = job.row;
  view.tasks_done = job.tasks_done;
  view.artifacts = ArtifactsOf(job);
  view.phases = PhasesOf(job);
  for (const auto& [name, parts] : job.previews) view.previews.push_back({name + ".png", std::ssize(parts)});
  std::chrono::microseconds left{0};
  for (const auto& [phase, progress] : job.phases) {
    const auto kind = std::find_if(kinds_.begin(), kinds_.end(), [&](const plan::Kind& k) { return k.kind == phase; });
    left += Scaled(progress.left, sched_.SpeedRatio(static_cast<int>(kind - kinds_.begin())));
  }
  // Later stages are not known, and without a running task there is no speed.
  const size_t running = sched_.HasJob(sched::JobId{job.row.id}) ? sched_.RunningOf(sched::JobId{job.row.id}) : 0;
  const bool open = job.stages.empty() || job.stages.back().next_stage_after.has_value();
  if (running > 0 && !open) {
    view.left_low = Scaled(left, 0.75 / static_cast<double>(running));
    view.left_high = Scaled(left, 1.6 / static_cast<double>(running));
  }
  return view;
}

absl::StatusOr<JobView> Coordinator::Get(int64_t id) {
  {
    const Lock lock(mutex_);
    const auto job = jobs_.find(id);
    if (job != jobs_.end()) return ViewOf(job->second);
  }
  const std::lock_guard lock(reader_mutex_);
  BAKEWELL_ASSIGN_OR_RETURN(const auto row, reader_->FindJob(id));
  if (!row) return absl::NotFoundError(absl::StrCat("no job ", id));
  return ViewOfRow(*row);
}

absl::StatusOr<std::vector<JobView>> Coordinator::List(const store::JobFilter& filter) {
  std::vector<store::JobRow> rows;
  {
    const std::lock_guard lock(reader_mutex_);
    BAKEWELL_ASSIGN_OR_RETURN(rows, reader_->ListJobs(filter));
  }
  std::vector<JobView> views;
  const Lock lock(mutex_);
  for (const store::JobRow& row : rows) {
    const auto job = jobs_.find(row.id);
    JobView view = ViewOfRow(job == jobs_.end() ? row : job->second.row);
    if (job != jobs_.end()) view.tasks_done = job->second.tasks_done;
    views.push_back(std::move(view));
  }
  return views;
}

absl::StatusOr<TaskOutput> Coordinator::FindArtifact(int64_t id, std::string_view name) {
  BAKEWELL_ASSIGN_OR_RETURN(const JobView view, Get(id));
  const TaskOutput* artifact = FindOutput(view.artifacts, name);
  if (artifact == nullptr) {
    return absl::NotFoundError(absl::StrCat("job ", id, " has no artifact '", std::string(name), "' (yet)"));
  }
  if (!blobs_->Has(artifact->digest)) {
    return absl::DataLossError(absl::StrCat("artifact '", std::string(name), "' of job ", id,
                                            " was lost or collected: submit the scene again"));
  }
  return *artifact;
}

void Coordinator::ForgetTasks(int64_t id) {
  for (const plan::TaskGraph& stage : jobs_.at(id).stages) {
    for (const plan::PlannedTask& planned : stage.tasks) {
      const auto found = by_key_.find(planned.key);
      if (found != by_key_.end()) std::erase(TaskOf(found->second).jobs, id);
    }
  }
  for (const TaskId task : sched_.ForgetJob(sched::JobId{id})) {
    by_key_.erase(TaskOf(task).key);
    TaskOf(task) = Task{};
  }
}

void Coordinator::EndJob(int64_t id, store::JobState state, const absl::Status& reason, Done done) {
  const auto found = jobs_.find(id);
  if (found == jobs_.end() || found->second.ending) {
    if (done) writer_->Submit([](store::Tables&) { return absl::OkStatus(); }, std::move(done));
    return;
  }
  // Workers are free at once; clients hear of it once it is safe.
  Job& job = found->second;
  job.ending = true;
  store::JobRow row = job.row;
  row.state = state;
  row.reason = std::string(reason.message());
  row.code = static_cast<int>(reason.code());
  row.finished_us = WallNowUs();
  row.artifacts = SerializeOutputs(ArtifactsOf(job));
  row.phases = SerializePhases(PhasesOf(job));
  ForgetTasks(id);
  job.stages.clear();
  const auto write = [row](store::Tables& tables) -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(tables.UpdateJob(row));
    return tables.DeleteStages(row.id);
  };
  writer_->Submit(write, [this, id, done = std::move(done)](const absl::Status& status) {
    if (status.ok()) {
      const Lock lock(mutex_);
      jobs_.erase(id);
      tick_now_ = true;
      tick_.notify_all();
    }
    if (done) done(status);
  });
}

absl::Status Coordinator::Cancel(int64_t id) {
  constexpr auto kPatience = std::chrono::seconds(5);  // with a disk that takes nothing
  BAKEWELL_RETURN_IF_ERROR(Get(id).status());
  const auto ended = std::make_shared<std::promise<absl::Status>>();
  {
    const Lock lock(mutex_);
    EndJob(id, store::JobState::kCancelled, absl::CancelledError("cancelled"),
           [ended](const absl::Status& status) { ended->set_value(status); });
    HandleEvents();
    Dispatch();
  }
  auto future = ended->get_future();
  if (future.wait_for(kPatience) == std::future_status::ready) return future.get();
  return absl::UnavailableError(absl::StrCat("job ", id, " runs no more, but that is not safe on disk yet: ",
                                             std::string(writer_->Trouble().message()), "; repeat it"));
}

absl::Status Coordinator::SetPriority(int64_t id, int priority) {
  if (priority < 0 || priority > 1000) return absl::InvalidArgumentError("a priority is from 0 to 1000");
  store::JobRow row;
  {
    const Lock lock(mutex_);
    const auto job = jobs_.find(id);
    if (job == jobs_.end() || job->second.ending) return absl::NotFoundError(absl::StrCat("no running job ", id));
    job->second.row.priority = priority;
    sched_.SetPriority(sched::JobId{id}, priority);
    job->second.changed = true;
    row = job->second.row;
  }
  return writer_->TryRun([&](store::Tables& tables) { return tables.UpdateJob(row); });
}

absl::Status Coordinator::SetAccount(const store::AccountRow& account) {
  return writer_->TryRun([&](store::Tables& tables) { return tables.PutAccount(account); });
}

absl::StatusOr<std::vector<store::FailureRow>> Coordinator::Failures(int64_t job, int limit) {
  const std::lock_guard lock(reader_mutex_);
  return reader_->RecentFailures(job, limit);
}

void Coordinator::NotifyWatchers() {
  std::set<int64_t> running, changed;
  {
    const Lock lock(mutex_);
    for (auto& [id, job] : jobs_) {
      running.insert(id);
      if (std::exchange(job.changed, false)) changed.insert(id);
    }
  }
  // A job that is not running any more has changed for the last time.
  watches_.Notify([&](int64_t job) { return changed.contains(job) || !running.contains(job); });
}

}  // namespace bakewell::job
