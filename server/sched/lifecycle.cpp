// Jobs and tasks of the Scheduler: how they come, become ready, are done and go.
#include <algorithm>
#include <bit>
#include <tuple>

#include "core/base/check.h"
#include "server/sched/scheduler.h"

namespace bakewell::sched {

namespace {

constexpr int64_t kMebibyte = 1 << 20;

// Memory in steps of powers of two MiB: the class of a task, rounded up.
int MemoryStep(int64_t memory_bytes) {
  if (memory_bytes <= kMebibyte) return 0;
  return static_cast<int>(std::bit_width(static_cast<uint64_t>((memory_bytes - 1) / kMebibyte)));
}

}  // namespace

Scheduler::Scheduler(const Options& options, LeaseToken last_token)
    : options_(options), next_token_(static_cast<uint64_t>(last_token) + 1) {}

void Scheduler::AddJob(JobId job, const JobInfo& info) {
  BAKEWELL_CHECK(jobs_.try_emplace(job, Job{info, {}, 0, 0, false}).second);
  ready_.AddJob(job, info);
}

TaskId Scheduler::NewTask() {
  if (!free_.empty()) {
    const TaskId id = free_.back();
    free_.pop_back();
    TaskOf(id) = Task{};
    return id;
  }
  tasks_.emplace_back();
  return TaskId{static_cast<uint32_t>(tasks_.size() - 1)};
}

bool Scheduler::Matches(const Class& wanted, const WorkerInfo& info) const {
  const bool can = (info.capabilities >> wanted.capability) & 1;
  return can && (wanted.memory_step >= 43 || info.memory_bytes >= kMebibyte << wanted.memory_step);
}

int Scheduler::ClassOf(const TaskInfo& info) {
  BAKEWELL_CHECK(info.capability >= 0 && info.capability < 64);
  const int step = MemoryStep(info.memory_bytes);
  for (size_t i = 0; i < classes_.size(); ++i) {
    if (classes_[i].capability == info.capability && classes_[i].memory_step == step) return static_cast<int>(i);
  }
  const int index = static_cast<int>(classes_.size());
  classes_.push_back({info.capability, step});
  for (auto& [id, worker] : workers_) {
    if (!Matches(classes_.back(), worker.info)) continue;
    worker.classes.push_back(index);
    if (!worker.draining) ++classes_.back().workers;
  }
  return index;
}

TaskId Scheduler::AddTask(JobId job, const TaskInfo& info) {
  const TaskId id = NewTask();
  const int class_index = ClassOf(info);
  Task& task = TaskOf(id);
  task.class_index = class_index;
  task.order = info.order;
  task.cost = std::max(Time(1), info.cost);
  task.home = job;
  task.jobs.push_back(job);
  Job& owner = jobs_.at(job);
  owner.tasks.push_back(id);
  if (info.done) {
    task.state = State::kDone;
    return id;
  }
  ++owner.remaining;
  task.state = State::kWaiting;
  for (const TaskId need : info.needs) {
    Task& needed = TaskOf(need);
    BAKEWELL_CHECK(needed.state != State::kFree);
    needed.dependants.push_back(id);
    if (needed.state == State::kDone) continue;
    ++task.waiting_for;
  }
  if (task.waiting_for == 0) MakeReady(id);
  return id;
}

void Scheduler::JoinTask(JobId job, TaskId id) {
  Task& task = TaskOf(id);
  BAKEWELL_CHECK(task.state != State::kFree);
  if (std::find(task.jobs.begin(), task.jobs.end(), job) != task.jobs.end()) return;
  task.jobs.push_back(job);
  jobs_.at(job).tasks.push_back(id);
  if (task.state == State::kDone) return;
  ++jobs_.at(job).remaining;
  SetHome(id, BestHome(task));
}

JobId Scheduler::BestHome(const Task& task) const {
  return *std::min_element(task.jobs.begin(), task.jobs.end(), [&](JobId a, JobId b) {
    return std::tuple(-jobs_.at(a).info.priority, a) < std::tuple(-jobs_.at(b).info.priority, b);
  });
}

void Scheduler::SetHome(TaskId id, JobId home) {
  Task& task = TaskOf(id);
  if (task.home == home) return;
  if (task.state == State::kReady) ready_.Remove(id, SlotOf(task));
  const size_t running = task.leases.size();
  if (const auto old = jobs_.find(task.home); old != jobs_.end()) old->second.running -= running;
  jobs_.at(home).running += running;
  task.home = home;
  if (task.state == State::kReady) ready_.Push(id, SlotOf(task));
}

void Scheduler::MakeReady(TaskId id) {
  Task& task = TaskOf(id);
  task.state = State::kReady;
  ready_.Push(id, SlotOf(task));
}

void Scheduler::CloseJob(JobId job) {
  jobs_.at(job).info.open = false;
  FinishIfDone(job);
}

void Scheduler::FinishIfDone(JobId id) {
  Job& job = jobs_.at(id);
  if (job.ended || job.info.open || job.remaining > 0) return;
  job.ended = true;
  events_.push_back({Event::Kind::kJobDone, id, {}, {}, {}});
}

void Scheduler::MarkDone(TaskId id, WorkerId by) {
  Task& task = TaskOf(id);
  task.state = State::kDone;
  task.excluded = {};
  // Workers that hold what a task needs are reminded of it.
  const auto worker = workers_.find(by);
  for (const TaskId dependant : task.dependants) {
    Task& next = TaskOf(dependant);
    if (next.state != State::kWaiting || --next.waiting_for > 0) continue;
    MakeReady(dependant);
    if (worker != workers_.end()) worker->second.hints.push_back(dependant);
  }
  constexpr size_t kMaxHints = 256;
  while (worker != workers_.end() && worker->second.hints.size() > kMaxHints) worker->second.hints.pop_front();
  for (const JobId job : task.jobs) {
    --jobs_.at(job).remaining;
    FinishIfDone(job);
  }
}

void Scheduler::Reopen(TaskId id) {
  Task& task = TaskOf(id);
  if (task.state != State::kDone) return;
  for (const JobId job : task.jobs) ++jobs_.at(job).remaining;
  MakeReady(id);
  for (const TaskId dependant : task.dependants) {
    Task& next = TaskOf(dependant);
    if (next.state == State::kDone) continue;
    if (next.state == State::kReady) ready_.Remove(dependant, SlotOf(next));
    RevokeLeases(dependant);
    next.state = State::kWaiting;
    ++next.waiting_for;
  }
}

void Scheduler::FailJobsOf(TaskId id) {
  for (const JobId job : TaskOf(id).jobs) {
    Job& owner = jobs_.at(job);
    if (owner.ended) continue;
    owner.ended = true;
    events_.push_back({Event::Kind::kJobFailed, job, id, {}, {}});
  }
}

void Scheduler::SetPriority(JobId id, int priority) {
  Job& job = jobs_.at(id);
  const auto queued = ready_.QueuedOf(id);
  for (const auto& [task, slot] : queued) ready_.Remove(task, slot);
  job.info.priority = priority;
  ready_.SetPriority(id, priority);
  for (const auto& [task, slot] : queued) ready_.Push(task, slot);
  for (const TaskId task : job.tasks) {
    if (TaskOf(task).jobs.size() > 1 && TaskOf(task).state != State::kDone) SetHome(task, BestHome(TaskOf(task)));
  }
}

void Scheduler::LeaveJob(JobId job, TaskId id) {
  Task& task = TaskOf(id);
  task.jobs.erase(std::find(task.jobs.begin(), task.jobs.end(), job));
  if (!task.jobs.empty()) {
    if (task.home == job) SetHome(id, BestHome(task));
    return;
  }
  if (task.state == State::kReady) ready_.Remove(id, SlotOf(task));
  RevokeLeases(id);
  FreeTask(id);
}

void Scheduler::FreeTask(TaskId id) {
  TaskOf(id) = Task{};
  free_.push_back(id);
}

std::vector<TaskId> Scheduler::ForgetJob(JobId id) {
  const auto job = jobs_.find(id);
  BAKEWELL_CHECK(job != jobs_.end());
  const std::vector<TaskId> tasks = std::move(job->second.tasks);
  // Backwards: dependants go before what they need, so no freed id stays in a list of dependants.
  std::vector<TaskId> freed;
  for (auto task = tasks.rbegin(); task != tasks.rend(); ++task) {
    LeaveJob(id, *task);
    if (TaskOf(*task).state == State::kFree) freed.push_back(*task);
  }
  ready_.RemoveJob(id);
  jobs_.erase(id);
  // What stays belongs to other jobs; it forgets dependants that are gone.
  for (const TaskId task : tasks) {
    std::erase_if(TaskOf(task).dependants, [&](TaskId next) { return TaskOf(next).state == State::kFree; });
  }
  return freed;
}

void Scheduler::CancelJob(JobId job) { ForgetJob(job); }

void Scheduler::SetSpeedRatio(int capability, double ratio) {
  if (speed_ratio_.size() <= static_cast<size_t>(capability)) speed_ratio_.resize(capability + 1, 0.0);
  speed_ratio_[capability] = ratio;
}

bool Scheduler::Measured(int capability) const {
  return static_cast<size_t>(capability) < speed_ratio_.size() && speed_ratio_[capability] > 0;
}

double Scheduler::SpeedRatio(int capability) const { return Measured(capability) ? speed_ratio_[capability] : 1.0; }

void Scheduler::CheckConsistent() const {
  size_t ready = 0, leased = 0;
  absl::flat_hash_map<JobId, size_t> remaining, running;
  for (const Task& task : tasks_) {
    if (task.state == State::kFree) continue;
    ready += task.state == State::kReady;
    leased += task.leases.size();
    running[task.home] += task.leases.size();
    BAKEWELL_CHECK_OP((task.state == State::kRunning), ==, !task.leases.empty());
    BAKEWELL_CHECK_OP((task.state == State::kWaiting), ==, (task.waiting_for > 0));
    for (const JobId job : task.jobs) remaining[job] += task.state != State::kDone;
    for (const LeaseToken token : task.leases) BAKEWELL_CHECK(leases_.contains(token));
  }
  BAKEWELL_CHECK_OP(ready, ==, ready_.size());
  BAKEWELL_CHECK_OP(leased, ==, leases_.size());
  BAKEWELL_CHECK_OP(leases_.size(), ==, run_limits_.size());
  BAKEWELL_CHECK_OP(workers_.size(), ==, silences_.size());
  for (const auto& [id, job] : jobs_) {
    BAKEWELL_CHECK_OP(job.remaining, ==, remaining[id]);
    BAKEWELL_CHECK_OP(job.running, ==, running[id]);
  }
  size_t held = 0;
  for (const auto& [id, worker] : workers_) held += worker.leases.size();
  BAKEWELL_CHECK_OP(held, ==, leases_.size());
}

}  // namespace bakewell::sched
