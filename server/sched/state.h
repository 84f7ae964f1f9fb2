#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <vector>

#include "server/sched/types.h"

// What a Scheduler remembers of tasks, leases, jobs and workers.
namespace bakewell::sched {

// A worker that failed a task, and when it may have it again if nobody else can.
struct Exclusion {
  WorkerId worker;
  Time until;
  int times;
};

enum class State : uint8_t { kFree, kWaiting, kReady, kRunning, kDone };
struct Task {
  State state = State::kFree;
  uint8_t failures = 0;
  uint8_t lost = 0;
  bool duplicated = false;
  int class_index = 0;
  uint32_t waiting_for = 0;
  uint64_t order = 0;
  Time cost{0};
  JobId home{};
  std::vector<JobId> jobs;
  std::vector<LeaseToken> leases;
  std::vector<TaskId> dependants;
  std::vector<Exclusion> excluded;  // one a worker
};
// A lease.
struct Held {
  TaskId task;
  WorkerId worker;
  Time start, deadline, charged, straggler_due;
  JobId charged_to;
};
struct Job {
  JobInfo info;
  std::vector<TaskId> tasks;
  size_t remaining = 0;
  size_t running = 0;  // leases on tasks whose home this is
  bool ended = false;
};
struct Worker {
  WorkerInfo info;
  std::vector<int> classes;
  Time silent_at{0};
  Time rests_until{0};
  bool draining = false;
  int failures_in_a_row = 0;
  int rests = 0;
  JobId at{};
  std::set<LeaseToken> leases;
  std::deque<TaskId> hints;  // became ready through this worker's result, newest last
};
struct Class {
  int capability;
  int memory_step;
  int workers = 0;  // that are not draining
};

}  // namespace bakewell::sched
