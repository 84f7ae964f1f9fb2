#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace bakewell::sched {

// Time is handed in by the caller, from any steady clock; only differences count.
using Time = std::chrono::microseconds;

enum class JobId : int64_t {};
enum class TaskId : uint32_t {};      // dense, reused after a task is forgotten
enum class WorkerId : uint64_t {};    // never reused
enum class LeaseToken : uint64_t {};  // fencing token: rises for as long as the farm exists, over restarts too

inline constexpr WorkerId kNoWorker{0};

struct JobInfo {
  std::string user;
  int priority = 0;    // higher first; kInteractive before kBatch
  int64_t weight = 1;  // the user's share is proportional to it, at least 1
  bool open = false;   // more tasks will be added: not finished when those known are
};
inline constexpr int kBatch = 0;
inline constexpr int kInteractive = 100;

struct TaskInfo {
  int capability = 0;         // 0 to 63: the kind and code version that a worker must have
  uint64_t order = 0;         // within a job the lowest goes first
  Time cost{0};               // expected run time
  int64_t memory_bytes = 0;   // a worker with less is not asked
  std::vector<TaskId> needs;  // tasks that must be done before
  bool done = false;          // known already
};

struct WorkerInfo {
  uint64_t capabilities = 0;  // bit i: can run TaskInfo::capability i
  int64_t memory_bytes = INT64_MAX;
};

struct Grant {
  LeaseToken token;
  TaskId task;
  Time run_limit;  // from now; a worker that takes longer loses the lease
};

enum class Completion : uint8_t {
  kAccepted,     // first result of this task, also from a lease that had run out
  kAlreadyDone,  // another result was first: the caller compares the bytes
};

enum class FailureKind : uint8_t {
  kRetry,      // the worker's trouble: another worker may succeed
  kPermanent,  // the task's own fault: no worker can do it
};

// What happened, in order; taken with Scheduler::TakeEvents.
struct Event {
  enum class Kind : uint8_t {
    kJobDone,       // job
    kJobFailed,     // job, task (its last failure)
    kRevoked,       // worker, token, task: result not wanted any more, the worker should stop
    kLeaseLost,     // worker, token, task: the worker fell silent
    kLeaseTimeout,  // worker, token, task: ran longer than its limit
    kWorkerLost,    // worker
    kWorkerRests,   // worker: failed too often in a row, gets nothing for a while
    kStraggler,     // worker, token, task: granted a second time because the first holder is slow
  };
  Kind kind;
  JobId job{};
  TaskId task{};
  WorkerId worker{};
  LeaseToken token{};
};

struct Options {
  Time heartbeat_timeout = std::chrono::seconds(15);  // a silent worker's leases go back
  Time min_run_limit = std::chrono::seconds(120);     // run limit is run_limit_factor x expected, at least this
  int run_limit_factor = 20;
  int straggler_factor = 2;  // run twice after this many times the expected time, at a job's end
  Time min_straggler = std::chrono::seconds(2);
  int unmeasured_factor = 10;  // times both, for a kind of which no run has been measured
  int max_failures = 3;        // workers that failed the task; however often one of them did, it counts once
  // Where nobody else can take a task, a worker that failed it gets it again after `retry`, doubling up to 64 times; a
  // task that has failed max_tries times on whomever there was fails as well.
  Time retry = std::chrono::seconds(1);
  int max_tries = 10;
  int max_lost = 12;                     // workers that fell silent while they held the task
  int rest_after = 5;                    // failures in a row
  Time rest = std::chrono::seconds(10);  // doubles with each further rest, up to 64 times
};

}  // namespace bakewell::sched
