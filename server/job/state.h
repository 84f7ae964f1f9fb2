#pragma once

#include <map>
#include <optional>

#include "server/job/types.h"
#include "server/plan/plan.h"

// What a Coordinator remembers of tasks, jobs and workers.
namespace bakewell::job {

struct Task {
  TaskKey key;
  TaskSpec spec;
  TaskOutputs outputs;  // once done
  int64_t memory_bytes = 0;
  std::chrono::microseconds cost{0};
  bool done = false;
  std::vector<int64_t> jobs;
};
struct Phase {
  int64_t done = 0, total = 0;
  std::chrono::microseconds left{0};  // estimated, of what is not done
  std::chrono::microseconds run{0};   // measured
  std::optional<sched::Time> began;   // first lease
  sched::Time ended{0};               // last result
};
struct Job {
  store::JobRow row;
  std::vector<plan::TaskGraph> stages;  // without the tasks' specs once they are in tasks_
  std::map<std::string, Phase> phases;
  int64_t tasks_done = 0;
  absl::Status last_failure;  // of a task of its
  // Blobs of pictures that fill in, in the order in which they came; a task that was done twice is there twice.
  std::map<std::string, std::vector<Digest>, std::less<>> previews;
  bool changed = true, ending = false;
};
void AddPreviews(const TaskOutputs& outputs, Job& job);
struct Worker {
  WorkerDescription about;
  LeaseSink sink;
  uint64_t connection = 0;
  int credit = 0;
  bool draining = false;
  int64_t done = 0, failed = 0;
  sched::Time seen{0};
};
struct Stage {
  plan::TaskGraph graph;
  std::vector<std::optional<TaskOutputs>> known;  // by task
};
}  // namespace bakewell::job
