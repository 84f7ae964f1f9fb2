// Workers and leases of the Scheduler: who gets a task, and how a lease ends.
#include <algorithm>

#include "core/base/check.h"
#include "server/sched/scheduler.h"

namespace bakewell::sched {

void Scheduler::AddWorker(WorkerId id, const WorkerInfo& info, Time now) {
  Worker worker;
  worker.info = info;
  worker.silent_at = now + options_.heartbeat_timeout;
  for (size_t i = 0; i < classes_.size(); ++i) {
    if (!Matches(classes_[i], info)) continue;
    worker.classes.push_back(static_cast<int>(i));
    ++classes_[i].workers;
  }
  silences_.insert({worker.silent_at, id});
  BAKEWELL_CHECK(workers_.try_emplace(id, std::move(worker)).second);
}

bool Scheduler::Heartbeat(WorkerId id, Time now) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return false;
  Worker& worker = found->second;
  silences_.erase({worker.silent_at, id});
  worker.silent_at = now + options_.heartbeat_timeout;
  silences_.insert({worker.silent_at, id});
  return true;
}

void Scheduler::SetDraining(WorkerId id, bool draining) {
  const auto found = workers_.find(id);
  if (found == workers_.end() || found->second.draining == draining) return;
  found->second.draining = draining;
  for (const int index : found->second.classes) classes_[index].workers += draining ? -1 : 1;
}

void Scheduler::RemoveWorker(WorkerId id) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  const std::set<LeaseToken> held = found->second.leases;
  for (const LeaseToken token : held) Release(leases_.at(token).task, token);
  DropWorker(id);
}

void Scheduler::DropWorker(WorkerId id) {
  const auto found = workers_.find(id);
  BAKEWELL_CHECK(found->second.leases.empty());
  SetDraining(id, true);
  silences_.erase({found->second.silent_at, id});
  workers_.erase(found);
}

size_t Scheduler::LeasesOf(WorkerId id) const {
  const auto found = workers_.find(id);
  return found == workers_.end() ? 0 : found->second.leases.size();
}

bool Scheduler::MayLease(WorkerId id, Time now) const {
  const auto found = workers_.find(id);
  if (found == workers_.end() || found->second.draining || found->second.rests_until > now) return false;
  const std::vector<int>& classes = found->second.classes;
  return std::any_of(classes.begin(), classes.end(), [&](int index) { return ready_.ReadyOfClass(index) > 0; });
}

std::vector<Grant> Scheduler::Lease(WorkerId id, int count, Time now) {
  std::vector<Grant> grants;
  const auto found = workers_.find(id);
  if (found == workers_.end()) return grants;
  Worker& worker = found->second;
  if (worker.draining || worker.rests_until > now) return grants;
  while (static_cast<int>(grants.size()) < count) {
    std::optional<TaskId> task = PickReady(worker, id, now);
    if (task) task = PickHinted(worker, *task);
    if (!task) {
      task = PickStraggler(worker, id, now);
      if (!task) break;
      grants.push_back(GrantLease(id, *task, now));
      events_.push_back({Event::Kind::kStraggler, TaskOf(*task).home, *task, id, grants.back().token});
      continue;
    }
    grants.push_back(GrantLease(id, *task, now));
  }
  return grants;
}

std::vector<Grant> Scheduler::Adopt(WorkerId id, TaskId task, Time now) {
  if (!workers_.contains(id) || TaskOf(task).state != State::kReady) return {};
  return {GrantLease(id, task, now)};
}

bool Scheduler::MayRun(const Task& task, WorkerId id, Time now) const {
  const auto own = std::find_if(task.excluded.begin(), task.excluded.end(),
                                [&](const Exclusion& exclusion) { return exclusion.worker == id; });
  if (own == task.excluded.end()) return true;
  // An exclusion is for good only while somebody else could run the task.
  const auto could_elsewhere = classes_[task.class_index].workers;
  const auto excluded = std::count_if(task.excluded.begin(), task.excluded.end(), [&](const Exclusion& exclusion) {
    const auto found = workers_.find(exclusion.worker);
    return found != workers_.end() && !found->second.draining;
  });
  return excluded >= could_elsewhere && now >= own->until;
}

std::optional<TaskId> Scheduler::PickReady(const Worker& worker, WorkerId id, Time now) {
  return ready_.Find(worker.classes, worker.at, [&](TaskId task) { return MayRun(TaskOf(task), id, now); });
}

std::optional<TaskId> Scheduler::PickHinted(Worker& worker, TaskId best) {
  const Task& leader = TaskOf(best);
  if (leader.failures > 0) return best;
  // Hints name tasks by id, and an id may have been given again: what counts is that the task could be picked now.
  constexpr int kMaxTries = 8;
  for (int tried = 0; tried < kMaxTries && !worker.hints.empty(); ++tried) {
    const TaskId hint = worker.hints.front();
    worker.hints.pop_front();
    const Task& task = TaskOf(hint);
    if (task.state != State::kReady || task.home != leader.home || task.failures > 0) continue;
    const auto& classes = worker.classes;
    if (std::find(classes.begin(), classes.end(), task.class_index) != classes.end()) return hint;
  }
  return best;
}

std::optional<TaskId> Scheduler::PickStraggler(const Worker& worker, WorkerId id, Time now) {
  constexpr int kMaxTries = 16;
  int tried = 0;
  for (const auto& [due, candidate] : stragglers_) {
    if (due > now || ++tried > kMaxTries) break;
    const Task& task = TaskOf(candidate);
    if (leases_.at(task.leases.front()).worker == id || ready_.ReadyOf(task.home) > 0) continue;
    const auto& classes = worker.classes;
    if (std::find(classes.begin(), classes.end(), task.class_index) == classes.end()) continue;
    if (MayRun(task, id, now)) return candidate;
  }
  return std::nullopt;
}

Time Scheduler::Expected(const Task& task) const {
  const double ratio = SpeedRatio(classes_[task.class_index].capability);
  return Time(std::max<int64_t>(1, static_cast<int64_t>(ratio * static_cast<double>(task.cost.count()))));
}

void Scheduler::WatchStraggler(TaskId id) {
  const Task& task = TaskOf(id);
  if (task.leases.size() == 1) stragglers_.insert({leases_.at(task.leases.front()).straggler_due, id});
}

void Scheduler::UnwatchStraggler(TaskId id) {
  const Task& task = TaskOf(id);
  if (task.leases.size() == 1) stragglers_.erase({leases_.at(task.leases.front()).straggler_due, id});
}

Grant Scheduler::GrantLease(WorkerId worker_id, TaskId id, Time now) {
  Task& task = TaskOf(id);
  Worker& worker = workers_.at(worker_id);
  if (task.state == State::kReady) ready_.Remove(id, SlotOf(task));
  UnwatchStraggler(id);
  task.state = State::kRunning;
  const LeaseToken token{next_token_++};
  const Time expected = Expected(task);
  const Time limit = std::max(options_.min_run_limit, expected * options_.run_limit_factor);
  // Of a kind that was never measured here there is a guess only, and machines that others use are slow.
  const int patience = Measured(classes_[task.class_index].capability) ? 1 : options_.unmeasured_factor;
  const Time due = now + patience * std::max(options_.min_straggler, expected * options_.straggler_factor);
  leases_[token] = {id, worker_id, now, now + limit, expected, due, task.home};
  run_limits_.insert({now + limit, token});
  task.leases.push_back(token);
  worker.leases.insert(token);
  worker.at = task.home;
  ++jobs_.at(task.home).running;
  ready_.Charge(task.home, expected);
  WatchStraggler(id);
  return {token, id, limit};
}

void Scheduler::EndLease(LeaseToken token) {
  const Held lease = leases_.at(token);
  Task& task = TaskOf(lease.task);
  UnwatchStraggler(lease.task);
  task.leases.erase(std::find(task.leases.begin(), task.leases.end(), token));
  WatchStraggler(lease.task);
  --jobs_.at(task.home).running;
  workers_.at(lease.worker).leases.erase(token);
  run_limits_.erase({lease.deadline, token});
  leases_.erase(token);
  if (task.leases.empty()) MakeReady(lease.task);
}

void Scheduler::RevokeLeases(TaskId id) {
  if (TaskOf(id).leases.empty()) return;
  while (!TaskOf(id).leases.empty()) {
    const LeaseToken token = TaskOf(id).leases.front();
    events_.push_back({Event::Kind::kRevoked, TaskOf(id).home, id, leases_.at(token).worker, token});
    EndLease(token);
  }
  // The last lease's end made it ready again; whoever revokes decides what it is instead.
  ready_.Remove(id, SlotOf(TaskOf(id)));
}

Completion Scheduler::Complete(TaskId id, LeaseToken token, Time now) {
  Task& task = TaskOf(id);
  const auto lease = leases_.find(token);
  const bool current = lease != leases_.end() && lease->second.task == id;
  if (task.state == State::kDone) return Completion::kAlreadyDone;
  WorkerId by = kNoWorker;
  if (current) {
    // Learn how long this kind takes, and charge the user what it took.
    const Time took = std::max(Time(1), now - lease->second.start);
    const int capability = classes_[task.class_index].capability;
    const double ratio = static_cast<double>(took.count()) / static_cast<double>(task.cost.count());
    // The first one is believed: on a machine that others use too, everything takes longer, and is no straggler.
    const double before = SpeedRatio(capability), share = Measured(capability) ? 0.1 : 1.0;
    SetSpeedRatio(capability, before + share * (std::min(ratio, 100.0) - before));
    if (jobs_.contains(lease->second.charged_to)) ready_.Charge(lease->second.charged_to, took - lease->second.charged);
    by = lease->second.worker;
    workers_.at(by).failures_in_a_row = 0;
    workers_.at(by).rests = 0;
    EndLease(token);
  }
  if (task.state == State::kReady) ready_.Remove(id, SlotOf(task));
  RevokeLeases(id);
  MarkDone(id, by);
  return Completion::kAccepted;
}

void Scheduler::CompleteKnown(TaskId id) {
  Task& task = TaskOf(id);
  if (task.state == State::kDone) return;
  if (task.state == State::kReady) ready_.Remove(id, SlotOf(task));
  RevokeLeases(id);
  MarkDone(id, kNoWorker);
}

bool Scheduler::Release(TaskId id, LeaseToken token) {
  const auto lease = leases_.find(token);
  if (lease == leases_.end() || lease->second.task != id) return false;
  if (jobs_.contains(lease->second.charged_to)) ready_.Charge(lease->second.charged_to, -lease->second.charged);
  EndLease(token);
  return true;
}

bool Scheduler::Fail(TaskId id, LeaseToken token, FailureKind kind, Time now) {
  const auto lease = leases_.find(token);
  if (lease == leases_.end() || lease->second.task != id) return false;
  const WorkerId worker = lease->second.worker;
  EndLease(token);
  Blame(id, worker, kind, now);
  return true;
}

void Scheduler::Exclude(Task& task, WorkerId worker, Time now) {
  auto own = std::find_if(task.excluded.begin(), task.excluded.end(),
                          [&](const Exclusion& exclusion) { return exclusion.worker == worker; });
  if (own == task.excluded.end()) own = task.excluded.insert(own, {worker, now, 0});
  own->until = now + options_.retry * (int64_t{1} << std::min(own->times++, 6));
}

void Scheduler::Blame(TaskId id, WorkerId worker, FailureKind kind, Time now) {
  Task& task = TaskOf(id);
  // The slot of a queued task says whether it failed: take it out while that changes.
  const bool queued = task.state == State::kReady;
  if (queued) ready_.Remove(id, SlotOf(task));
  ++task.failures;
  Exclude(task, worker, now);
  if (queued) ready_.Push(id, SlotOf(task));
  const bool given_up = std::ssize(task.excluded) >= options_.max_failures || task.failures >= options_.max_tries;
  if (kind == FailureKind::kPermanent || given_up) {
    FailJobsOf(id);
    return;
  }
  BlameWorker(worker, now);
}

void Scheduler::BlameWorker(WorkerId id, Time now) {
  Worker& worker = workers_.at(id);
  if (++worker.failures_in_a_row < options_.rest_after) return;
  worker.failures_in_a_row = 0;
  worker.rests_until = now + options_.rest * (int64_t{1} << std::min(worker.rests++, 6));
  events_.push_back({Event::Kind::kWorkerRests, {}, {}, id, {}});
}

void Scheduler::LoseLease(LeaseToken token) {
  const Held lease = leases_.at(token);
  events_.push_back({Event::Kind::kLeaseLost, TaskOf(lease.task).home, lease.task, lease.worker, token});
  EndLease(token);
  if (++TaskOf(lease.task).lost >= options_.max_lost) FailJobsOf(lease.task);
}

void Scheduler::TimeOutLease(LeaseToken token, Time now) {
  const Held lease = leases_.at(token);
  events_.push_back({Event::Kind::kLeaseTimeout, TaskOf(lease.task).home, lease.task, lease.worker, token});
  events_.push_back({Event::Kind::kRevoked, TaskOf(lease.task).home, lease.task, lease.worker, token});
  EndLease(token);
  Blame(lease.task, lease.worker, FailureKind::kRetry, now);
}

void Scheduler::Tick(Time now) {
  while (!run_limits_.empty() && run_limits_.begin()->first <= now) TimeOutLease(run_limits_.begin()->second, now);
  while (!silences_.empty() && silences_.begin()->first <= now) {
    const WorkerId id = silences_.begin()->second;
    const std::set<LeaseToken> held = workers_.at(id).leases;
    for (const LeaseToken token : held) LoseLease(token);
    events_.push_back({Event::Kind::kWorkerLost, {}, {}, id, {}});
    DropWorker(id);
  }
}

Time Scheduler::NextDeadline() const {
  Time next = Time::max();
  if (!run_limits_.empty()) next = std::min(next, run_limits_.begin()->first);
  if (!silences_.empty()) next = std::min(next, silences_.begin()->first);
  return next;
}

std::vector<Event> Scheduler::TakeEvents() { return std::exchange(events_, {}); }

}  // namespace bakewell::sched
