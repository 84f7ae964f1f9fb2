#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/artifact/task.h"
#include "server/sched/types.h"
#include "server/store/tables.h"

namespace bakewell::job {

// A job as clients see it.
struct PhaseView {
  std::string phase;  // the task kind
  int64_t done = 0, total = 0;
  // What its tasks took together, and from its first lease to its last result; of this process's life.
  std::chrono::microseconds run{0}, wall{0};
};
// For the database. Parse is safe on hostile bytes: kDataLoss.
std::string SerializePhases(const std::vector<PhaseView>& phases);
absl::StatusOr<std::vector<PhaseView>> ParsePhases(std::string_view bytes);

// A picture of a page that is not finished (server/preview).
struct PreviewView {
  std::string name;   // with ".png"
  int64_t parts = 0;  // how many tasks' results it has
};

struct JobView {
  store::JobRow row;
  int64_t tasks_done = 0;
  std::vector<PhaseView> phases;
  TaskOutputs artifacts;              // those that exist by now
  std::vector<PreviewView> previews;  // while it runs
  // Time left, an interval; negative: not known yet.
  std::chrono::microseconds left_low{-1}, left_high{-1};
};

struct SubmitRequest {
  std::string user, client_key, name;
  Digest scene;
  std::string settings;
  int priority = 0;
};

struct SubmitResult {
  int64_t job_id = 0;
  bool existed = false;
};

struct Estimate {
  int64_t tasks = 0, tasks_known = 0;
  std::chrono::microseconds run_low{0}, run_high{0};
  int64_t memory_bytes = 0;
  bool complete = true;
};

struct WorkerDescription {
  std::string name, isa;
  int cores = 0;
  int64_t memory_bytes = 0;
  uint64_t capabilities = 0;  // bit i: Planner::Kinds()[i]
};

struct WorkerView {
  sched::WorkerId id{};
  WorkerDescription about;
  bool draining = false;
  size_t leases = 0;
  int64_t tasks_done = 0, tasks_failed = 0;
  std::chrono::microseconds seen_ago{0};
};

struct TaskLease {
  sched::LeaseToken token{};
  TaskKey key;
  std::string spec;  // SerializeSpec, resolved
  std::chrono::microseconds run_limit{0};
  int64_t memory_bytes = 0;
};

struct LeaseNews {
  std::vector<TaskLease> leases;
  std::vector<sched::LeaseToken> revoked;
  bool drain = false;
  bool superseded = false;  // another connection of this worker takes this one's place
};

// How leases reach a worker. Called with the coordinator locked: it must only hand the news on, and not call back.
using LeaseSink = std::function<void(LeaseNews)>;

struct CompletedTask {
  sched::WorkerId worker{};
  sched::LeaseToken token{};
  TaskKey key;
  TaskOutputs outputs;
  std::chrono::microseconds run{0};
};

struct FailedTask {
  sched::WorkerId worker{};
  sched::LeaseToken token{};
  TaskKey key;
  absl::Status status;
  std::vector<Digest> missing_inputs;
};

// Counters since the start, and what is now.
struct Stats {
  size_t ready = 0, leases = 0, workers = 0, running_jobs = 0, tasks = 0;
  int64_t store_bytes = 0, store_quota_bytes = 0;
  size_t blobs = 0;
  int64_t completed = 0, known = 0, failed = 0, conflicts = 0, lost_leases = 0, stragglers = 0, run_us = 0;
  uint64_t corrupt_blobs = 0, commits = 0, writes = 0, write_backlog = 0;
  std::string trouble;
};

using Done = std::function<void(const absl::Status&)>;

}  // namespace bakewell::job
