// What a task goes through at a worker: fetch, run, upload, complete.
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/base/caught.h"
#include "proto/rpc/transfer.h"
#include "worker/rpc/worker.h"

namespace bakewell {

namespace {

using Clock = std::chrono::steady_clock;

std::chrono::microseconds Since(Clock::time_point start) {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start);
}

TaskOutputs DescriptionOf(const MadeOutputs& made) {
  TaskOutputs outputs;
  for (const MadeOutput& output : made) {
    outputs.push_back({output.name, Sha256Of(output.bytes), std::ssize(output.bytes)});
  }
  return outputs;
}

std::vector<Blob> BlobsOf(MadeOutputs made) {
  std::vector<Blob> blobs;
  for (MadeOutput& output : made) blobs.push_back(std::make_shared<const std::string>(std::move(output.bytes)));
  return blobs;
}

bool IsFinal(const absl::Status& status) {
  return status.ok() || absl::IsAborted(status) || absl::IsInvalidArgument(status) || absl::IsUnauthenticated(status) ||
         absl::IsPermissionDenied(status);
}

}  // namespace

// The next task whose memory fits beside what runs; one that fits nowhere runs alone.
Worker::TaskPtr Worker::NextToRun() {
  for (auto next = queue_.begin(); next != queue_.end(); ++next) {
    const TaskPtr task = *next;
    const int64_t bytes = task->lease.memory_bytes;
    const bool fits = running_ == 0 || running_bytes_ + bytes <= options_.identity.memory_bytes;
    if (!fits && !task->cancelled) continue;
    queue_.erase(next);
    return task;
  }
  return nullptr;
}

void Worker::SlotLoop() {
  for (;;) {
    TaskPtr task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ended_ || (task = NextToRun()) != nullptr; });
      if (ended_ && !task) return;
      task->stage = Stage::kRunning;
      running_bytes_ += task->lease.memory_bytes;
      ++running_;
    }
    RunTask(task);
    {
      const std::lock_guard lock(mutex_);
      running_bytes_ -= task->lease.memory_bytes;
      --running_;
    }
    changed_.notify_all();
  }
}

void Worker::RunTask(const TaskPtr& task) {
  std::vector<Digest> missing;
  const auto run = [&]() -> absl::StatusOr<MadeOutputs> {
    BAKEWELL_ASSIGN_OR_RETURN(const TaskInputs inputs, FetchInputs(*task, missing));
    if (task->stop.stop_requested()) return absl::CancelledError("not wanted any more");
    const auto start = Clock::now();
    auto made = executor_.Run(task->lease.spec, inputs, task->stop.get_token());
    task->run = Since(start);
    return made;
  };
  auto made = [&]() -> absl::StatusOr<MadeOutputs> {
    {
      const std::lock_guard lock(mutex_);
      if (task->cancelled) return absl::CancelledError("not wanted any more");
    }
    return Caught(run);
  }();
  // What a task hands in that was told to stop may be a part of its result.
  if (task->stop.stop_requested()) made = absl::CancelledError("stopped");
  if (!made.ok()) return Report(task, made.status(), missing);
  {
    const std::lock_guard lock(mutex_);
    task->made = *std::move(made);
    task->stage = Stage::kUploading;
    uploads_.push_back(task);
  }
  changed_.notify_all();
  Refill();
}

absl::StatusOr<TaskInputs> Worker::FetchInputs(const Task& task, std::vector<Digest>& missing) {
  TaskInputs inputs;
  for (const TaskInput& input : task.lease.spec.inputs) {
    const Digest* digest = std::get_if<Digest>(&input.source);
    if (digest == nullptr) return absl::InvalidArgumentError(absl::StrCat("input '", input.name, "' is unresolved"));
    auto blob = cache_.Get(*digest);
    if (!blob.ok()) {
      if (absl::IsNotFound(blob.status()) || absl::IsDataLoss(blob.status())) missing.push_back(*digest);
      return absl::UnavailableError(absl::StrCat("input '", input.name, "': ", blob.status().message()));
    }
    inputs.emplace_back(input.name, *std::move(blob));
  }
  return inputs;
}

void Worker::Forget(const TaskPtr& task) {
  const std::lock_guard lock(mutex_);
  const auto found = tasks_.find(task->lease.key);
  if (found != tasks_.end() && found->second == task) tasks_.erase(found);
  if (tasks_.empty()) idle_since_ = Clock::now();
  changed_.notify_all();
}

// Asks for one more task, unless this worker is to leave.
void Worker::Refill() {
  {
    const std::lock_guard lock(mutex_);
    if (options_.once || draining_) return;
  }
  link_.AddCredit(1);
}

// A task that was not done: said to be failed, or given back if somebody asked for that.
void Worker::Report(const TaskPtr& task, const absl::Status& status, const std::vector<Digest>& missing) {
  bool cancelled = false;
  uint64_t token = 0;
  {
    const std::lock_guard lock(mutex_);
    cancelled = task->cancelled || ended_;
    token = task->lease.token;
    (cancelled ? counters_.given_back : counters_.failed) += 1;
  }
  // If this gets lost the lease runs out by itself.
  absl::Status told = absl::OkStatus();
  if (cancelled)
    told = link_.Release(WorkerId(), {{token, task->lease.key}}, /*goodbye=*/false);
  else
    told = link_.Fail(WorkerId(), task->lease, status, missing);
  if (!cancelled) options_.log(absl::StrCat(task->lease.spec.kind, " failed: ", status.ToString()));
  if (!told.ok()) options_.log(absl::StrCat("could not report it: ", told.ToString()));
  Forget(task);
  Refill();
}

void Worker::PrefetchLoop() {
  for (;;) {
    TaskPtr task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] {
        const auto next = std::find_if(queue_.begin(), queue_.end(), [](const TaskPtr& t) { return !t->prefetched; });
        if (next != queue_.end()) task = *next;
        return ended_ || task != nullptr;
      });
      if (ended_) return;
      task->prefetched = true;
      if (task->cancelled) continue;
    }
    // What cannot be had now is asked for again, and reported, when the task runs.
    std::vector<Digest> ignored;
    FetchInputs(*task, ignored).status().IgnoreError();
  }
}

void Worker::UploadLoop() {
  for (;;) {
    TaskPtr task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ended_ || !uploads_.empty(); });
      if (ended_) return;
      task = uploads_.front();
      uploads_.pop_front();
    }
    Deliver(task);
  }
}

absl::Status Worker::TryDeliver(const TaskPtr& task, const TaskOutputs& outputs, const std::vector<Blob>& blobs) {
  std::vector<Digest> digests;
  for (const TaskOutput& output : outputs) digests.push_back(output.digest);
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<Digest> missing, FindMissing(link_.connection(), digests));
  for (const Digest& digest : missing) {
    const auto index = std::find(digests.begin(), digests.end(), digest) - digests.begin();
    const std::string& bytes = *blobs[static_cast<size_t>(index)];
    BAKEWELL_RETURN_IF_ERROR(UploadBlob(link_.connection(), digest, bytes));
    const std::lock_guard lock(mutex_);
    counters_.uploaded_bytes += std::ssize(bytes);
  }
  LeasedTask lease;
  {
    const std::lock_guard lock(mutex_);
    lease = task->lease;  // the token may have changed with a new registration
  }
  return link_.Complete(WorkerId(), lease, outputs, task->run);
}

// Sends the result until it is acknowledged: work that was done is not lost to a restart of the coordinator.
void Worker::Deliver(const TaskPtr& task) {
  const TaskOutputs outputs = DescriptionOf(task->made);
  const std::vector<Blob> blobs = BlobsOf(std::move(task->made));
  // Before anybody hears of the result: the task that needs it may be leased to this worker at once.
  for (size_t i = 0; i < outputs.size(); ++i) cache_.Put(outputs[i].digest, blobs[i]);
  auto pause = std::chrono::milliseconds(50);
  absl::StatusCode outage = absl::StatusCode::kOk;  // said once, not at every try
  for (;;) {
    const absl::Status status = TryDeliver(task, outputs, blobs);
    if (IsFinal(status)) {
      if (!status.ok()) options_.log(absl::StrCat("result refused: ", status.ToString()));
      const std::lock_guard lock(mutex_);
      (status.ok() ? counters_.done : counters_.failed) += 1;
      break;
    }
    if (status.code() != outage) {
      options_.log(absl::StrCat("a result of ", task->lease.spec.kind, " is tried again: ", status.ToString()));
    }
    outage = status.code();
    if (options_.undelivered) options_.undelivered(status);
    Pause(pause);
    pause = std::min(pause * 2, std::chrono::milliseconds(2000));
    const std::lock_guard lock(mutex_);
    if (ended_) return;
  }
  Forget(task);
}

}  // namespace bakewell
