// The worker's connection: registering, leases, heartbeats, leaving. work.cpp has what a task goes through.
#include "worker/rpc/worker.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "proto/rpc/transfer.h"

namespace bakewell {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int kDownloadTries = 5;
constexpr int kUploadThreads = 2;

bool IsRefusal(const absl::Status& status) {
  return absl::IsUnauthenticated(status) || absl::IsPermissionDenied(status) || absl::IsInvalidArgument(status) ||
         absl::IsFailedPrecondition(status) || absl::IsUnimplemented(status);
}

WorkerOptions Filled(WorkerOptions options, const TaskExecutor& executor) {
  options.identity.kinds = executor.Kinds();
  if (!options.log) options.log = [](std::string_view) {};
  return options;
}

}  // namespace

Worker::Worker(std::shared_ptr<Connection> connection, TaskExecutor& executor, WorkerOptions options)
    : executor_(executor),
      options_(Filled(std::move(options), executor)),
      link_(std::move(connection)),
      cache_(options_.cache_bytes,
             [this](const Digest& digest) {
               auto bytes = DownloadBlob(link_.connection(), digest, options_.max_blob_bytes, kDownloadTries);
               const std::lock_guard lock(mutex_);
               if (bytes.ok()) counters_.downloaded_bytes += std::ssize(*bytes);
               return bytes;
             }),
      idle_since_(Clock::now()) {
  for (int i = 0; i < options_.slots; ++i) threads_.emplace_back([this] { SlotLoop(); });
  for (int i = 0; i < kUploadThreads; ++i) threads_.emplace_back([this] { UploadLoop(); });
  threads_.emplace_back([this] { PrefetchLoop(); });
  threads_.emplace_back([this] { HeartbeatLoop(); });
}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = draining_ = true;
    for (const auto& [key, task] : tasks_) task->stop.request_stop();
  }
  link_.HangUpForGood();
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

WorkerCounters Worker::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

uint64_t Worker::WorkerId() const {
  const std::lock_guard lock(mutex_);
  return worker_id_;
}

void Worker::Drain() {
  {
    const std::lock_guard lock(mutex_);
    if (!draining_) drain_at_ = Clock::now();
    draining_ = true;
  }
  changed_.notify_all();
}

bool Worker::WaitForTasks(std::chrono::milliseconds limit) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, limit, [this] { return running_ == 0; });
}

int Worker::FreeCredit() const {
  const auto held = std::count_if(tasks_.begin(), tasks_.end(),
                                  [](const auto& task) { return task.second->stage != Stage::kUploading; });
  const int capacity = options_.once ? 1 : options_.slots + options_.prefetch;
  return draining_ ? 0 : std::max<int>(0, capacity - static_cast<int>(held));
}

std::vector<TaskKey> Worker::Held() {
  std::vector<TaskKey> held;
  const std::lock_guard lock(mutex_);
  for (const auto& [key, task] : tasks_) held.push_back(key);
  return held;
}

// New tokens for what goes on; what the coordinator does not want any more stops, unless its result is there already.
void Worker::Adopt(const Registration& registration) {
  const std::lock_guard lock(mutex_);
  worker_id_ = registration.worker_id;
  heartbeat_ = registration.heartbeat;
  std::vector<TaskKey> adopted;
  for (const LeasedTask& lease : registration.adopted) {
    adopted.push_back(lease.key);
    if (const auto task = tasks_.find(lease.key); task != tasks_.end()) task->second->lease.token = lease.token;
  }
  for (const auto& [key, task] : tasks_) {
    if (task->stage == Stage::kUploading) continue;
    if (std::find(adopted.begin(), adopted.end(), key) != adopted.end()) continue;
    task->cancelled = true;
    task->stop.request_stop();
  }
  changed_.notify_all();
}

void Worker::Take(LeaseNews news) {
  const std::lock_guard lock(mutex_);
  for (LeasedTask& lease : news.leases) {
    const TaskKey key = lease.key;
    if (const auto held = tasks_.find(key); held != tasks_.end()) {
      held->second->lease.token = lease.token;  // ours from an earlier lease, and still at work
      continue;
    }
    const auto task = std::make_shared<Task>();
    task->lease = std::move(lease);
    tasks_[key] = task;
    queue_.push_back(task);
  }
  for (const uint64_t token : news.revoked) Revoke(token);
  if (news.superseded) link_.HangUp();  // and connects again
  if (news.drain && !draining_) {
    draining_ = true;
    drain_at_ = Clock::now();
  }
  changed_.notify_all();
}

void Worker::Revoke(uint64_t token) {
  for (const auto& [key, task] : tasks_) {
    if (task->lease.token != token) continue;
    task->cancelled = true;
    task->stop.request_stop();
  }
}

// Registers, unless the coordinator still knows this worker: then its leases go on.
absl::Status Worker::Join() {
  if (WorkerId() != 0) {
    const absl::Status known = link_.Heartbeat(WorkerId());
    if (!absl::IsFailedPrecondition(known)) return known;
    const std::lock_guard lock(mutex_);
    worker_id_ = 0;
  }
  BAKEWELL_ASSIGN_OR_RETURN(const Registration registration, link_.Register(options_.identity, Held()));
  options_.log(absl::StrCat("registered as worker ", registration.worker_id));
  Adopt(registration);
  return absl::OkStatus();
}

// Joins, and listens for leases until the stream breaks.
absl::Status Worker::Session() {
  BAKEWELL_RETURN_IF_ERROR(Join());
  int credit = 0;
  {
    const std::lock_guard lock(mutex_);
    credit = FreeCredit();
  }
  return link_.Listen(WorkerId(), credit, [this](LeaseNews news) { Take(std::move(news)); });
}

absl::Status Worker::Run() {
  // Leaving is decided beside the stream, which only ends when somebody hangs up.
  std::thread leaver([this] {
    WaitToLeave();
    link_.HangUpForGood();
  });
  absl::Status refusal;
  absl::StatusCode outage = absl::StatusCode::kOk;  // said once, not at every try
  while (!ShouldLeave()) {
    const absl::Status status = Session();
    if (ShouldLeave()) break;
    // Only Register, which comes while there is no id, refuses for good.
    if (IsRefusal(status) && WorkerId() == 0) {
      refusal = status;
      break;
    }
    if (status.code() != outage) options_.log(absl::StrCat("connection lost: ", status.ToString()));
    outage = status.code();
    Pause(std::chrono::milliseconds(300));
  }
  Drain();
  {
    const std::lock_guard lock(mutex_);
    ended_ = !refusal.ok() || ended_;
  }
  changed_.notify_all();
  leaver.join();
  Leave();
  return refusal;
}

void Worker::WaitToLeave() {
  std::unique_lock lock(mutex_);
  while (!ShouldLeaveLocked()) {
    // What is to come by itself is the end of the grace, or of the patience without a task; all else is notified.
    if (draining_)
      changed_.wait_until(lock, drain_at_ + options_.grace);
    else if (options_.idle_exit.count() > 0 && tasks_.empty())
      changed_.wait_until(lock, idle_since_ + options_.idle_exit);
    else
      changed_.wait(lock);
  }
}

bool Worker::ShouldLeave() {
  const std::lock_guard lock(mutex_);
  return ShouldLeaveLocked();
}

// Whether there is nothing left to wait for.
bool Worker::ShouldLeaveLocked() {
  if (ended_) return true;
  const auto now = Clock::now();
  const bool had_one = options_.once && counters_.done + counters_.failed > 0;
  const bool idle = options_.idle_exit.count() > 0 && tasks_.empty() && now - idle_since_ >= options_.idle_exit;
  if (!draining_ && (had_one || idle)) {
    draining_ = true;
    drain_at_ = now;
  }
  if (!draining_) return false;
  GiveBackQueued();
  return tasks_.empty() || now - drain_at_ >= options_.grace;
}

void Worker::GiveBackQueued() {
  bool any = false;
  for (const TaskPtr& task : queue_) any |= !std::exchange(task->cancelled, true);
  if (any) changed_.notify_all();
}

// Says goodbye; the coordinator takes back whatever is still held.
void Worker::Leave() {
  std::vector<std::pair<uint64_t, TaskKey>> held;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    for (const auto& [key, task] : tasks_) {
      held.emplace_back(task->lease.token, key);
      task->stop.request_stop();
    }
    counters_.given_back += std::ssize(held);
  }
  changed_.notify_all();
  const absl::Status status = link_.Release(WorkerId(), held, /*goodbye=*/true);
  if (!status.ok()) options_.log(absl::StrCat("left without a goodbye: ", std::string(status.message())));
}

void Worker::HeartbeatLoop() {
  Clock::time_point beat{};
  std::unique_lock lock(mutex_);
  while (!ended_) {
    // A registration, which may ask for other heartbeats, is notified.
    if (worker_id_ == 0) {
      changed_.wait(lock);
      continue;
    }
    if (Clock::now() < beat + heartbeat_) {
      changed_.wait_until(lock, beat + heartbeat_);
      continue;
    }
    beat = Clock::now();
    const uint64_t id = worker_id_;
    lock.unlock();
    const absl::Status status = link_.Heartbeat(id);
    // Unknown to a coordinator that restarted: the session begins anew.
    if (absl::IsFailedPrecondition(status)) link_.HangUp();
    lock.lock();
  }
}

void Worker::Pause(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, time, [this] { return ended_; });
}

}  // namespace bakewell
