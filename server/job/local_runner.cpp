#include "server/job/local_runner.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <future>

#include "core/base/caught.h"

namespace bakewell::job {

LocalRunner::LocalRunner(Coordinator& coordinator, LocalTasks tasks, int threads)
    : coordinator_(coordinator), tasks_(std::move(tasks)) {
  if (tasks_.empty()) return;
  std::vector<plan::Kind> kinds;
  for (const LocalKind& task : tasks_) kinds.push_back(task.kind);
  worker_ = coordinator_.AddWorker({"coordinator", "", threads, INT64_MAX, coordinator_.CapabilitiesOf(kinds)});
  connection_ = coordinator_.Connect(worker_, [this](LeaseNews news) {
    const std::lock_guard lock(mutex_);
    for (TaskLease& lease : news.leases) leases_.push_back(std::move(lease));
    wake_.notify_all();
  });
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this](std::stop_token stop) { Loop(stop); });
  threads_.emplace_back([this](std::stop_token stop) { Beat(stop); });
  coordinator_.AddCredit(worker_, threads);
}

LocalRunner::~LocalRunner() {
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
  if (connection_ == 0) return;
  coordinator_.Disconnect(worker_, connection_);
  coordinator_.RemoveWorker(worker_);
}

void LocalRunner::Beat(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    lock.unlock();
    coordinator_.Heartbeat(worker_);
    lock.lock();
    wake_.wait_for(lock, stop, coordinator_.options().sched.heartbeat_timeout / 3, [] { return false; });
  }
}

void LocalRunner::Loop(std::stop_token stop) {
  for (;;) {
    TaskLease lease;
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return !leases_.empty(); })) return;
      lease = std::move(leases_.front());
      leases_.pop_front();
    }
    Run(lease);
    coordinator_.AddCredit(worker_, 1);
  }
}

void LocalRunner::Run(const TaskLease& lease) {
  const auto start = std::chrono::steady_clock::now();
  const auto outputs = Caught([&] { return Make(lease); });
  if (!outputs.ok()) {
    coordinator_.Fail({worker_, lease.token, lease.key, outputs.status(), {}});
    return;
  }
  const auto run = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);
  std::promise<absl::Status> committed;
  coordinator_.Complete({worker_, lease.token, lease.key, *outputs, run},
                        [&](const absl::Status& status) { committed.set_value(status); });
  // A result that was not accepted leaves the lease to run out, and the task to be run again.
  committed.get_future().get().IgnoreError();
}

absl::StatusOr<TaskOutputs> LocalRunner::Make(const TaskLease& lease) {
  BAKEWELL_ASSIGN_OR_RETURN(const TaskSpec spec, ParseSpec(lease.spec));
  const auto task = std::find_if(tasks_.begin(), tasks_.end(), [&](const LocalKind& local) {
    return local.kind == plan::Kind{spec.kind, spec.code_version};
  });
  if (task == tasks_.end()) return absl::InternalError(absl::StrCat("no code for ", spec.kind));
  std::vector<std::string> inputs;
  for (const TaskInput& input : spec.inputs) {
    BAKEWELL_ASSIGN_OR_RETURN(std::string bytes, coordinator_.blobs().Get(std::get<Digest>(input.source)));
    inputs.push_back(std::move(bytes));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<LocalBlob> made, task->run(spec, inputs));
  TaskOutputs outputs;
  for (const LocalBlob& blob : made) {
    BAKEWELL_ASSIGN_OR_RETURN(TaskOutput output, Store(blob));
    outputs.push_back(std::move(output));
  }
  return outputs;
}

absl::StatusOr<TaskOutput> LocalRunner::Store(const LocalBlob& blob) {
  const TaskOutput output{blob.name, Sha256Of(blob.bytes), std::ssize(blob.bytes)};
  if (!coordinator_.blobs().Has(output.digest)) {
    BAKEWELL_RETURN_IF_ERROR(coordinator_.blobs().Put(output.digest, blob.bytes));
  }
  std::promise<absl::Status> recorded;
  coordinator_.RecordBlob(output.digest, output.size_bytes,
                          [&](const absl::Status& status) { recorded.set_value(status); });
  BAKEWELL_RETURN_IF_ERROR(recorded.get_future().get());
  return output;
}

}  // namespace bakewell::job
