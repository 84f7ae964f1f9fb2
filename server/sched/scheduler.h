#pragma once

#include <absl/container/flat_hash_map.h>

#include <set>
#include <vector>

#include "core/base/status.h"
#include "server/sched/ready_queue.h"
#include "server/sched/state.h"
#include "server/sched/types.h"

namespace bakewell::sched {

// Who runs which task when: a pure state machine. No clock, disk or network; every call takes the time, and the same
// calls give the same answers. Each operation costs O(log n) in tasks, jobs and workers (Cancel and Forget: O(tasks of
// the job)). Not thread safe: its owner serialises calls. Nothing here can fail but by misuse, except where a Status
// says so.
//
// A task may be wanted by several jobs; it runs once, on behalf of the one that should go first (its *home*).
class Scheduler {
 public:
  // Tokens start above `last_token`, the highest that a former process may have given out.
  Scheduler(const Options& options, LeaseToken last_token);

  // --- jobs ---
  void AddJob(JobId job, const JobInfo& info);
  // `info.needs` must name tasks that `job` already has.
  TaskId AddTask(JobId job, const TaskInfo& info);
  // Another job wants the task too. No effect if it is a member already.
  void JoinTask(JobId job, TaskId task);
  // No more tasks will be added.
  void CloseJob(JobId job);
  void SetPriority(JobId job, int priority);
  // The job's tasks that nobody else wants are dropped, their leases revoked. The job is then forgotten.
  void CancelJob(JobId job);
  // As CancelJob, for a job that is done or failed. Returns the tasks that are now unknown: their ids may be given
  // again.
  std::vector<TaskId> ForgetJob(JobId job);
  bool HasJob(JobId job) const { return jobs_.contains(job); }

  // --- workers ---
  void AddWorker(WorkerId worker, const WorkerInfo& info, Time now);
  // False if the worker is unknown (it fell silent, or the coordinator restarted): it must register again.
  bool Heartbeat(WorkerId worker, Time now);
  // The worker says goodbye: its leases go back without blame.
  void RemoveWorker(WorkerId worker);
  // A draining worker gets no more leases.
  void SetDraining(WorkerId worker, bool draining);
  bool HasWorker(WorkerId worker) const { return workers_.contains(worker); }

  // --- leases ---
  // Up to `count` tasks for the worker, best first; fewer if there are no more that it may run.
  std::vector<Grant> Lease(WorkerId worker, int count, Time now);
  // A lease for a task that the worker holds already, from before a restart; nothing unless the task is free.
  std::vector<Grant> Adopt(WorkerId worker, TaskId task, Time now);
  // True if a Lease by this worker would find a task that has never failed, in O(classes).
  bool MayLease(WorkerId worker, Time now) const;
  Completion Complete(TaskId task, LeaseToken token, Time now);
  // Done without having been run (the catalogue knew it).
  void CompleteKnown(TaskId task);
  // The result of a task that is done was lost: it runs again, and what needs it and is not done waits.
  void Reopen(TaskId task);
  // False, and no effect, unless the token is the task's current one.
  bool Fail(TaskId task, LeaseToken token, FailureKind kind, Time now);
  // Gives the lease back without blame.
  bool Release(TaskId task, LeaseToken token);

  // Ends leases that ran out. Call at NextDeadline() or somewhat later.
  void Tick(Time now);
  Time NextDeadline() const;
  std::vector<Event> TakeEvents();

  // --- figures ---
  bool IsDone(TaskId task) const { return TaskOf(task).state == State::kDone; }
  size_t ready() const { return ready_.size(); }
  size_t leases() const { return leases_.size(); }
  size_t workers() const { return workers_.size(); }
  size_t tasks() const { return tasks_.size() - free_.size(); }
  size_t LeasesOf(WorkerId worker) const;
  size_t RunningOf(JobId job) const { return jobs_.at(job).running; }
  size_t RemainingOf(JobId job) const { return jobs_.at(job).remaining; }
  LeaseToken last_token() const { return LeaseToken{next_token_ - 1}; }
  // Measured over estimated run time of a capability, 1 until something was measured.
  double SpeedRatio(int capability) const;
  // What was measured before this scheduler's life; 0: nothing.
  void SetSpeedRatio(int capability, double ratio);
  // Aborts if the state contradicts itself; for tests. O(n).
  void CheckConsistent() const;

 private:
  bool Measured(int capability) const;
  Task& TaskOf(TaskId task) { return tasks_[static_cast<uint32_t>(task)]; }
  const Task& TaskOf(TaskId task) const { return tasks_[static_cast<uint32_t>(task)]; }
  ReadyQueue::Slot SlotOf(const Task& task) const {
    return {task.home, task.class_index, task.order, task.failures > 0};
  }

  // lifecycle.cpp: jobs and tasks
  TaskId NewTask();
  int ClassOf(const TaskInfo& info);
  bool Matches(const Class& wanted, const WorkerInfo& info) const;
  JobId BestHome(const Task& task) const;
  void SetHome(TaskId id, JobId home);
  void MakeReady(TaskId id);
  void MarkDone(TaskId id, WorkerId by);
  void FinishIfDone(JobId job);
  void FailJobsOf(TaskId id);
  void LeaveJob(JobId job, TaskId id);
  void FreeTask(TaskId id);

  // lease.cpp: grants and their ends
  Grant GrantLease(WorkerId worker, TaskId task, Time now);
  std::optional<TaskId> PickReady(const Worker& worker, WorkerId id, Time now);
  std::optional<TaskId> PickHinted(Worker& worker, TaskId best);
  std::optional<TaskId> PickStraggler(const Worker& worker, WorkerId id, Time now);
  bool MayRun(const Task& task, WorkerId worker, Time now) const;
  void EndLease(LeaseToken token);
  void RevokeLeases(TaskId id);
  void Exclude(Task& task, WorkerId worker, Time now);
  void Blame(TaskId id, WorkerId worker, FailureKind kind, Time now);
  void BlameWorker(WorkerId id, Time now);
  void LoseLease(LeaseToken token);
  void TimeOutLease(LeaseToken token, Time now);
  void DropWorker(WorkerId worker);
  Time Expected(const Task& task) const;
  void WatchStraggler(TaskId id);
  void UnwatchStraggler(TaskId id);

  Options options_;
  std::vector<Task> tasks_;
  std::vector<TaskId> free_;
  absl::flat_hash_map<JobId, Job> jobs_;
  absl::flat_hash_map<WorkerId, Worker> workers_;
  absl::flat_hash_map<LeaseToken, Held> leases_;
  std::vector<Class> classes_;
  ReadyQueue ready_;
  std::set<std::pair<Time, LeaseToken>> run_limits_;
  std::set<std::pair<Time, WorkerId>> silences_;
  std::set<std::pair<Time, TaskId>> stragglers_;  // running once, by when a second run is due
  std::vector<double> speed_ratio_;               // by capability; 0: none yet
  std::vector<Event> events_;
  uint64_t next_token_;
};

}  // namespace bakewell::sched
