#pragma once

#include <absl/container/flat_hash_map.h>

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/sched/types.h"

namespace bakewell::sched {

// The tasks that could run now, in the order in which they should: by priority; among users of equal priority the one
// that has had the least work for its weight (start-time fair queueing); among a user's jobs the oldest, unless the
// worker is at another of them; in a job by TaskInfo::order. Tasks are split by *class* (capability and memory step),
// so that a worker's question touches only what it can do: O(classes x log n). Not thread safe; a part of Scheduler.
class ReadyQueue {
 public:
  struct Slot {
    JobId job{};
    int class_index = 0;
    uint64_t order = 0;
    bool retry = false;  // failed before: workers must be asked whether they may
  };

  void AddJob(JobId job, const JobInfo& info);
  void SetPriority(JobId job, int priority);  // only while the job has no task queued
  void RemoveJob(JobId job);                  // only while the job has no task queued
  int Priority(JobId job) const { return jobs_.at(job).priority; }

  void Push(TaskId task, const Slot& slot);
  void Remove(TaskId task, const Slot& slot);

  // The best task among `classes` that `may_retry` does not refuse; `may_retry` is asked for tasks that failed before.
  // `at` is the job whose data the worker holds.
  std::optional<TaskId> Find(std::span<const int> classes, JobId at,
                             const std::function<bool(TaskId)>& may_retry) const;

  // Adds `work` (negative to give back) to what the job's user has had.
  void Charge(JobId job, Time work);

  size_t size() const { return size_; }
  size_t ReadyOf(JobId job) const { return jobs_.at(job).ready; }
  size_t ReadyOfClass(int class_index) const;
  // What is queued of one job, for a priority change.
  std::vector<std::pair<TaskId, Slot>> QueuedOf(JobId job) const;

 private:
  using Entry = std::pair<uint64_t, TaskId>;  // order, task
  struct Bin {
    std::set<Entry> fresh, retry;
    bool empty() const { return fresh.empty() && retry.empty(); }
  };
  struct Rank {
    int priority;
    Time had;
    int user;
    bool operator<(const Rank& other) const;
    bool operator==(const Rank& other) const = default;
  };
  using UserBins = std::map<uint64_t, Bin>;  // by Job::sequence
  struct Class {
    std::map<Rank, UserBins> users;
    size_t ready = 0;
  };
  struct User {
    Time had{0};                           // work divided by weight
    std::set<std::pair<int, int>> active;  // (class, priority) with tasks queued
  };
  struct Job {
    int user = 0;
    int priority = 0;
    int64_t weight = 1;
    uint64_t sequence = 0;
    size_t ready = 0;
  };
  struct Candidate {
    bool at;
    uint64_t sequence;
    Entry entry;
    bool operator<(const Candidate& other) const;
  };

  Rank RankOf(const Job& job) const { return {job.priority, users_[job.user].had, job.user}; }
  std::optional<Candidate> BestOf(const UserBins& bins, uint64_t at_sequence,
                                  const std::function<bool(TaskId)>& may_retry) const;
  static std::optional<Entry> FirstOf(const Bin& bin, const std::function<bool(TaskId)>& may_retry);

  std::vector<Class> classes_;
  std::vector<User> users_;
  absl::flat_hash_map<std::string, int> user_index_;
  absl::flat_hash_map<JobId, Job> jobs_;
  uint64_t next_sequence_ = 1;
  Time served_{0};  // what the last served user had had: where a user who was idle starts
  size_t size_ = 0;
};

}  // namespace bakewell::sched
