// Workers: what they are given, and what becomes of their answers.
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/job/coordinator.h"

namespace bakewell::job {

namespace {

const Digest* FindDigest(const TaskOutputs& outputs, const std::string& name) {
  for (const TaskOutput& output : outputs) {
    if (output.name == name) return &output.digest;
  }
  return nullptr;
}

bool IsTasksOwnFault(absl::StatusCode code) {
  return code == absl::StatusCode::kInvalidArgument || code == absl::StatusCode::kFailedPrecondition ||
         code == absl::StatusCode::kOutOfRange;
}

}  // namespace

sched::WorkerId Coordinator::AddWorker(const WorkerDescription& about) {
  const Lock lock(mutex_);
  const sched::WorkerId id{next_worker_++};
  workers_[id].about = about;
  workers_[id].seen = Now();
  sched_.AddWorker(id, {about.capabilities, about.memory_bytes}, Now());
  return id;
}

std::vector<TaskLease> Coordinator::Adopt(sched::WorkerId worker, const std::vector<TaskKey>& held) {
  std::vector<TaskLease> adopted;
  const Lock lock(mutex_);
  for (const TaskKey& key : held) {
    const auto task = by_key_.find(key);
    if (task == by_key_.end()) continue;
    for (const sched::Grant& grant : sched_.Adopt(worker, task->second, Now())) {
      if (auto lease = Prepare(grant)) adopted.push_back(std::move(*lease));
    }
  }
  return adopted;
}

bool Coordinator::Heartbeat(sched::WorkerId id) {
  const Lock lock(mutex_);
  const auto worker = workers_.find(id);
  if (worker == workers_.end() || !sched_.Heartbeat(id, Now())) return false;
  worker->second.seen = Now();
  return true;
}

uint64_t Coordinator::Connect(sched::WorkerId id, LeaseSink sink) {
  const Lock lock(mutex_);
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return 0;
  // The older one is told: if it is the true one, it comes back.
  if (worker->second.sink) worker->second.sink({{}, {}, false, true});
  worker->second.sink = std::move(sink);
  worker->second.credit = 0;
  worker->second.connection = next_connection_++;
  if (worker->second.draining) worker->second.sink({{}, {}, true});
  return worker->second.connection;
}

void Coordinator::Disconnect(sched::WorkerId id, uint64_t connection) {
  const Lock lock(mutex_);
  const auto worker = workers_.find(id);
  if (worker == workers_.end() || worker->second.connection != connection) return;
  hungry_.erase(id);
  worker->second.sink = nullptr;
  worker->second.credit = 0;
}

bool Coordinator::AddCredit(sched::WorkerId id, int credit) {
  constexpr int kMaxCredit = 64;
  const Lock lock(mutex_);
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return false;
  worker->second.credit = std::clamp(worker->second.credit + std::clamp(credit, 0, kMaxCredit), 0, kMaxCredit);
  LeaseTo(id, worker->second);
  HandleEvents();
  return true;
}

bool Coordinator::Drain(sched::WorkerId id, bool draining) {
  const Lock lock(mutex_);
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return false;
  worker->second.draining = draining;
  sched_.SetDraining(id, draining);
  if (worker->second.sink && draining) worker->second.sink({{}, {}, true});
  return true;
}

void Coordinator::RemoveWorker(sched::WorkerId id) {
  const Lock lock(mutex_);
  sched_.RemoveWorker(id);
  workers_.erase(id);
  hungry_.erase(id);
  HandleEvents();
  Dispatch();
}

std::vector<WorkerView> Coordinator::Workers() {
  std::vector<WorkerView> views;
  const Lock lock(mutex_);
  for (const auto& [id, worker] : workers_) {
    views.push_back(
        {id, worker.about, worker.draining, sched_.LeasesOf(id), worker.done, worker.failed, Now() - worker.seen});
  }
  std::sort(views.begin(), views.end(), [](const WorkerView& a, const WorkerView& b) { return a.id < b.id; });
  return views;
}

TaskSpec Coordinator::Resolve(const TaskSpec& spec) const {
  TaskSpec resolved = spec;
  for (TaskInput& input : resolved.inputs) {
    const OutputOf* made = std::get_if<OutputOf>(&input.source);
    if (made == nullptr) continue;
    // A producer that gave no such output gives the digest of nothing: the task fails, naming the input.
    const Digest* digest = FindDigest(TaskOf(by_key_.at(made->task)).outputs, made->output);
    input.source = digest == nullptr ? Digest{} : *digest;
  }
  return resolved;
}

// The lease as the worker gets it; nothing if its result turned out to be known under its action key.
std::optional<TaskLease> Coordinator::Prepare(const sched::Grant& grant) {
  const Task& task = TaskOf(grant.task);
  for (const int64_t job : task.jobs) {
    std::optional<sched::Time>& began = jobs_.at(job).phases[task.spec.kind].began;
    if (!began) began = Now();
  }
  if (IsResolved(task.spec)) {
    return TaskLease{grant.token, task.key, SerializeSpec(task.spec), grant.run_limit, task.memory_bytes};
  }
  const TaskSpec resolved = Resolve(task.spec);
  if (FinishIfKnown(grant.task, resolved, grant)) return std::nullopt;
  return TaskLease{grant.token, task.key, SerializeSpec(resolved), grant.run_limit, task.memory_bytes};
}

bool Coordinator::FinishIfKnown(TaskId id, const TaskSpec& resolved, const sched::Grant& grant) {
  const auto known = FindUsable(KeyOf(resolved));
  if (!known.ok() || !known->has_value()) return false;
  Task& task = TaskOf(id);
  sched_.Release(id, grant.token);
  task.outputs = (*known)->outputs;
  ++stats_.known;
  for (const int64_t job : task.jobs) ++jobs_.at(job).row.known_tasks;
  RememberResult(task, std::chrono::microseconds((*known)->run_us), {});
  CountDone(task);
  sched_.CompleteKnown(id);
  return true;
}

void Coordinator::LeaseTo(sched::WorkerId id, Worker& worker) {
  LeaseNews news;
  while (worker.sink && worker.credit > 0) {
    const auto grants = sched_.Lease(id, worker.credit, Now());
    if (grants.empty()) break;
    for (const sched::Grant& grant : grants) {
      auto lease = Prepare(grant);
      if (!lease) continue;
      news.leases.push_back(std::move(*lease));
      --worker.credit;
    }
  }
  if (!news.leases.empty()) worker.sink(std::move(news));
  if (worker.sink && worker.credit > 0)
    hungry_.insert(id);
  else
    hungry_.erase(id);
}

void Coordinator::Dispatch() {
  // Workers that wait are asked in turn; a few that match nothing do not make this slow, the tick asks the others.
  constexpr int kMaxMisses = 8;
  int misses = 0;
  for (auto next = hungry_.begin(); next != hungry_.end() && misses < kMaxMisses && sched_.ready() > 0;) {
    const sched::WorkerId id = *next++;
    const auto worker = workers_.find(id);
    const size_t before = sched_.leases();
    LeaseTo(id, worker->second);
    misses += sched_.leases() == before;
  }
  HandleEvents();
}

void Coordinator::CountDone(Task& task) {
  task.done = true;
  for (const int64_t id : task.jobs) {
    Job& job = jobs_.at(id);
    Phase& phase = job.phases[task.spec.kind];
    ++phase.done;
    phase.left -= task.cost;
    phase.ended = Now();
    AddPreviews(task.outputs, job);
    ++job.tasks_done;
    job.changed = true;
    const auto& last = job.stages.back();
    if (last.next_stage_after && *last.next_stage_after == task.key) ContinueLater(id);
  }
}

void Coordinator::RememberResult(const Task& task, std::chrono::microseconds run, Done done) {
  const store::KnownTask known{task.outputs, run.count(), WallNowUs()};
  std::vector<TaskKey> keys = {task.key};
  if (!IsResolved(task.spec)) keys.push_back(KeyOf(Resolve(task.spec)));
  writer_->Submit(
      [known, keys](store::Tables& tables) -> absl::Status {
        for (const TaskKey& key : keys) BAKEWELL_RETURN_IF_ERROR(tables.InsertKnown(key, known));
        return absl::OkStatus();
      },
      std::move(done));
}

void Coordinator::Complete(const CompletedTask& completed, Done done) {
  for (const TaskOutput& output : completed.outputs) {
    if (blobs_->SizeOf(output.digest) == output.size_bytes) continue;
    done(absl::NotFoundError(absl::StrCat("output '", output.name, "', blob ", output.digest.Hex(), " of ",
                                          output.size_bytes, " bytes, is not stored: upload it, then complete")));
    return;
  }
  const Lock lock(mutex_);
  const auto found = by_key_.find(completed.key);
  if (found == by_key_.end()) {
    CompleteForgotten(completed, std::move(done));
    return;
  }
  Task& task = TaskOf(found->second);
  if (task.done) {
    CompleteAgain(task, completed, std::move(done));
    return;
  }
  task.outputs = completed.outputs;
  sched_.Complete(found->second, completed.token, Now());
  ++stats_.completed;
  stats_.run_us += completed.run.count();
  if (const int kind = costs_.KindOf(task.spec); kind >= 0 && completed.run.count() > 0) {
    const double ratio = static_cast<double>(completed.run.count()) / static_cast<double>(task.cost.count());
    costs_.Learn(kind, ratio, sched_.SpeedRatio(kind), *writer_);
  }
  if (const auto worker = workers_.find(completed.worker); worker != workers_.end()) ++worker->second.done;
  for (const int64_t id : task.jobs) {
    Job& job = jobs_.at(id);
    job.row.run_us += completed.run.count() / std::ssize(task.jobs);
    job.phases[task.spec.kind].run += completed.run / std::ssize(task.jobs);
  }
  RememberResult(task, completed.run, std::move(done));
  CountDone(task);
  HandleEvents();
  Dispatch();
}

// A task that has a result: the same bytes are welcome, others are reported.
void Coordinator::CompleteAgain(const Task& task, const CompletedTask& completed, Done done) {
  if (task.outputs == completed.outputs) {
    RememberResult(task, completed.run, std::move(done));  // known, but perhaps not committed yet
    return;
  }
  ++stats_.conflicts;
  NoteFailure(task, WorkerName(completed.worker), "completed again with other bytes; the first result stands");
  writer_->Submit([](store::Tables&) { return absl::OkStatus(); },
                  [done = std::move(done)](const absl::Status&) {
                    done(absl::AbortedError("another worker's result of this task has other bytes"));
                  });
}

std::string Coordinator::WorkerName(sched::WorkerId id) const {
  const auto worker = workers_.find(id);
  return worker == workers_.end() ? "an unknown worker" : worker->second.about.name;
}

// The result of a task that no job wants any more: a later one may.
void Coordinator::CompleteForgotten(const CompletedTask& completed, Done done) {
  const store::KnownTask known{completed.outputs, completed.run.count(), WallNowUs()};
  auto conflict = std::make_shared<bool>(false);
  writer_->Submit(
      [known, key = completed.key, conflict](store::Tables& tables) -> absl::Status {
        BAKEWELL_ASSIGN_OR_RETURN(const auto before, tables.FindKnown(key));
        *conflict = before && before->outputs != known.outputs;
        return before ? absl::OkStatus() : tables.InsertKnown(key, known);
      },
      [conflict, done = std::move(done)](const absl::Status& status) {
        done(status.ok() && *conflict ? absl::AbortedError("the known result of this task has other bytes") : status);
      });
}

void Coordinator::NoteFailure(const Task& task, const std::string& worker, const std::string& reason) {
  const store::FailureRow row{WallNowUs(), task.jobs.empty() ? 0 : task.jobs.front(), task.spec.kind, task.key, worker,
                              reason};
  options_.log(absl::StrCat("job ", row.job, ": ", row.kind, " ", task.key.digest.Hex().substr(0, 12), " on ", worker,
                            ": ", absl::Utf8SafeCEscape(reason)));
  writer_->Submit([row](store::Tables& tables) { return tables.InsertFailure(row); });
}

// Makes the inputs again that the store had lost. False if nothing was lost after all.
bool Coordinator::RemakeInputs(const FailedTask& failed) {
  const TaskId id = by_key_.at(failed.key);
  const TaskSpec spec = TaskOf(id).spec;
  bool lost = false;
  for (const TaskInput& input : spec.inputs) {
    const OutputOf* made = std::get_if<OutputOf>(&input.source);
    const Digest* digest = made == nullptr ? std::get_if<Digest>(&input.source)
                                           : FindDigest(TaskOf(by_key_.at(made->task)).outputs, made->output);
    if (digest == nullptr || blobs_->Has(*digest)) continue;
    lost = true;
    if (made == nullptr) {
      const auto reason =
          absl::DataLossError(absl::StrCat("input '", input.name, "' was lost on the server: submit it again"));
      const std::vector<int64_t> jobs = TaskOf(id).jobs;
      for (const int64_t job : jobs) EndJob(job, store::JobState::kFailed, reason, {});
      return true;
    }
    Task& maker = TaskOf(by_key_.at(made->task));
    if (!maker.done) continue;
    std::vector<TaskKey> keys = {maker.key, KeyOf(Resolve(maker.spec))};
    writer_->Submit([keys](store::Tables& tables) -> absl::Status {
      for (const TaskKey& key : keys) BAKEWELL_RETURN_IF_ERROR(tables.DeleteKnown(key));
      return absl::OkStatus();
    });
    CountLost(maker);
    sched_.Reopen(by_key_.at(made->task));
  }
  return lost;
}

void Coordinator::CountLost(Task& task) {
  task.done = false;
  for (const int64_t id : task.jobs) {
    Job& job = jobs_.at(id);
    Phase& phase = job.phases[task.spec.kind];
    --phase.done;
    phase.left += task.cost;
    --job.tasks_done;
  }
}

void Coordinator::Fail(const FailedTask& failed) {
  const Lock lock(mutex_);
  const auto found = by_key_.find(failed.key);
  if (found == by_key_.end()) return;
  if (!failed.missing_inputs.empty() && RemakeInputs(failed)) {
    if (by_key_.contains(failed.key)) sched_.Release(found->second, failed.token);
  } else {
    const Task& task = TaskOf(found->second);
    const auto kind =
        IsTasksOwnFault(failed.status.code()) ? sched::FailureKind::kPermanent : sched::FailureKind::kRetry;
    const auto worker = workers_.find(failed.worker);
    NoteFailure(task, WorkerName(failed.worker), std::string(failed.status.message()));
    if (sched_.Fail(found->second, failed.token, kind, Now())) {
      ++stats_.failed;
      if (worker != workers_.end()) ++worker->second.failed;
      for (const int64_t job : task.jobs) jobs_.at(job).last_failure = failed.status;
    }
  }
  HandleEvents();
  Dispatch();
}

void Coordinator::Release(sched::WorkerId, const std::vector<std::pair<sched::LeaseToken, TaskKey>>& leases) {
  const Lock lock(mutex_);
  for (const auto& [token, key] : leases) {
    const auto task = by_key_.find(key);
    if (task != by_key_.end()) sched_.Release(task->second, token);
  }
  HandleEvents();
  Dispatch();
}

void Coordinator::HandleEvents() {
  using Kind = sched::Event::Kind;
  for (auto events = sched_.TakeEvents(); !events.empty(); events = sched_.TakeEvents()) {
    for (const sched::Event& event : events) {
      const int64_t job = static_cast<int64_t>(event.job);
      const auto worker = workers_.find(event.worker);
      switch (event.kind) {
        case Kind::kJobDone:
          EndJob(job, store::JobState::kDone, absl::OkStatus(), {});
          break;
        case Kind::kJobFailed: {
          const auto found = jobs_.find(job);
          const absl::Status last = found == jobs_.end() ? absl::OkStatus() : found->second.last_failure;
          EndJob(job, store::JobState::kFailed,
                 last.ok() ? absl::UnavailableError("workers were lost again and again") : last, {});
          break;
        }
        case Kind::kRevoked:
          if (worker != workers_.end() && worker->second.sink) worker->second.sink({{}, {event.token}, false});
          break;
        case Kind::kLeaseLost:
          ++stats_.lost_leases;
          break;
        case Kind::kLeaseTimeout:
          ++stats_.failed;
          options_.log(absl::StrCat("job ", job, ": a task ran longer than its limit on a worker"));
          break;
        case Kind::kWorkerLost:
          if (worker != workers_.end())
            options_.log(absl::StrCat("worker ", worker->second.about.name, " fell silent"));
          workers_.erase(event.worker);
          hungry_.erase(event.worker);
          break;
        case Kind::kWorkerRests:
          if (worker != workers_.end())
            options_.log(absl::StrCat("worker ", worker->second.about.name, " rests: it fails every task"));
          break;
        case Kind::kStraggler:
          ++stats_.stragglers;
          break;
      }
    }
  }
}

}  // namespace bakewell::job
