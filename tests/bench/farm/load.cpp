// Simulated workers against a real coordinator over loopback gRPC: leases a second, and how long a lease and an
// acknowledged completion take. The database lies in FOLDER, with real syncs.
//   farm_load FOLDER --workers 1000 --jobs 200 --tasks 5000 --run-ms 1000 --seconds 60 --known 1000000
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <queue>
#include <random>

#include "proto/bakewell/v1/worker.grpc.pb.h"
#include "proto/rpc/transfer.h"
#include "tests/support/farm.h"

namespace bakewell::test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Flags {
  std::string folder;
  int workers = 1000, jobs = 200, tasks = 5000, run_ms = 1000, seconds = 60, known = 0;
};

// Latencies of one kind of call. Thread safe.
class Latencies {
 public:
  void Add(Clock::duration time) {
    const std::lock_guard lock(mutex_);
    ms_.push_back(std::chrono::duration<double, std::milli>(time).count());
  }
  size_t Print(const char* name, double seconds) {
    const std::lock_guard lock(mutex_);
    std::sort(ms_.begin(), ms_.end());
    if (ms_.empty()) return 0;
    const auto at = [&](double share) { return ms_[static_cast<size_t>(share * static_cast<double>(ms_.size() - 1))]; };
    std::printf("%-10s %8zu calls %8.0f /s   p50 %7.2f ms   p99 %7.2f ms   max %7.2f ms\n", name, ms_.size(),
                static_cast<double>(ms_.size()) / seconds, at(0.5), at(0.99), ms_.back());
    return ms_.size();
  }
  void Clear() {
    const std::lock_guard lock(mutex_);
    ms_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<double> ms_;
};

// Calls things later, on one thread.
class Timer {
 public:
  Timer() : thread_([this] { Loop(); }) {}
  ~Timer() { Stop(); }
  void Stop() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    thread_.join();
  }
  // The longest that anything had to wait beyond its time.
  double late_ms() {
    const std::lock_guard lock(mutex_);
    return late_ms_;
  }
  void At(Clock::time_point due, std::function<void()> work) {
    const std::lock_guard lock(mutex_);
    queue_.push({due, next_++, std::move(work)});
    wake_.notify_all();
  }

 private:
  struct Item {
    Clock::time_point due;
    uint64_t order;
    std::function<void()> work;
    bool operator<(const Item& other) const { return std::tie(due, order) > std::tie(other.due, other.order); }
  };
  void Loop() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
      if (queue_.empty())
        wake_.wait(lock);
      else if (queue_.top().due > Clock::now())
        wake_.wait_until(lock, queue_.top().due);
      else {
        late_ms_ =
            std::max(late_ms_, std::chrono::duration<double, std::milli>(Clock::now() - queue_.top().due).count());
        const auto work = queue_.top().work;
        queue_.pop();
        lock.unlock();
        work();
        lock.lock();
      }
    }
  }
  std::mutex mutex_;
  std::condition_variable wake_;
  std::priority_queue<Item> queue_;
  uint64_t next_ = 0;
  bool stopping_ = false;
  double late_ms_ = 0;
  std::thread thread_;
};

struct Shared {
  Flags flags;
  Timer timer;
  Latencies lease, complete;
  std::string digest;
  int64_t size_bytes = 0;
  std::atomic<bool> stopping{false};
  std::atomic<int> calls{0};
};

// One worker: keeps a Lease stream with credit 1, "runs" what it gets, completes it, asks for more. Counts as long as
// its stream is open.
class Simulated final : public grpc::ClientBidiReactor<v1::LeaseRequest, v1::LeaseResponse> {
 public:
  Simulated(Shared& shared, std::shared_ptr<grpc::Channel> channel, int index)
      : shared_(shared), stub_(v1::WorkerService::NewStub(channel)) {
    v1::RegisterRequest request;
    request.set_name("sim" + std::to_string(index));
    request.set_cores(1);
    request.set_memory_bytes(int64_t{1} << 30);
    for (const TaskKind& kind : SyntheticExecutor().Kinds()) {
      request.add_capabilities()->set_kind(kind.kind);
      request.mutable_capabilities()->rbegin()->set_code_version(kind.code_version);
    }
    v1::RegisterResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->Register(&context, request, &response);
    if (!status.ok()) std::fprintf(stderr, "register: %s\n", status.error_message().c_str());
    id_ = response.worker_id();
    shared_.calls++;
    stub_->async()->Lease(&context_, this);
    asked_ = Clock::now();
    credit_.set_worker_id(id_);
    credit_.set_add_credit(1);
    StartWrite(&credit_);
    StartRead(&news_);
    AddHold();
    StartCall();
    Beat();
  }
  void OnWriteDone(bool) override {}
  void OnReadDone(bool ok) override {
    if (!ok) return;
    for (const v1::TaskLease& lease : news_.leases()) {
      shared_.lease.Add(Clock::now() - asked_);
      const auto due =
          Clock::now() +
          milliseconds(shared_.flags.run_ms == 0 ? 0 : shared_.flags.run_ms / 2 + random_() % shared_.flags.run_ms);
      const std::string key = lease.key();
      const uint64_t token = lease.token();
      if (shared_.flags.run_ms == 0)
        Complete(token, key);
      else
        shared_.timer.At(due, [this, token, key] { Complete(token, key); });
    }
    StartRead(&news_);
  }
  void OnDone(const grpc::Status&) override { shared_.calls--; }
  void Stop() {
    context_.TryCancel();
    RemoveHold();
  }

 private:
  struct Call {
    grpc::ClientContext context;
    v1::CompleteRequest request;
    v1::CompleteResponse response;
  };
  void Complete(uint64_t token, const std::string& key) {
    if (shared_.stopping) return;
    const auto call = std::make_shared<Call>();
    call->request.set_worker_id(id_);
    call->request.set_token(token);
    call->request.set_key(key);
    call->request.set_run_us(shared_.flags.run_ms * 1000);
    v1::TaskOutput& output = *call->request.add_outputs();
    output.set_name("out");
    output.set_digest(shared_.digest);
    output.set_size_bytes(shared_.size_bytes);
    const auto start = Clock::now();
    shared_.calls++;
    stub_->async()->Complete(&call->context, &call->request, &call->response,
                             [this, call, start](const grpc::Status& status) {
                               if (status.ok())
                                 shared_.complete.Add(Clock::now() - start);
                               else
                                 std::fprintf(stderr, "complete: %s\n", status.error_message().c_str());
                               if (!shared_.stopping) {
                                 asked_ = Clock::now();
                                 StartWrite(&credit_);
                               }
                               shared_.calls--;
                             });
  }
  void Beat() {
    if (shared_.stopping) return;
    struct Heartbeat {
      grpc::ClientContext context;
      v1::HeartbeatRequest request;
      v1::HeartbeatResponse response;
    };
    const auto beat = std::make_shared<Heartbeat>();
    beat->request.set_worker_id(id_);
    shared_.calls++;
    stub_->async()->Heartbeat(&beat->context, &beat->request, &beat->response,
                              [this, beat](const grpc::Status&) { shared_.calls--; });
    shared_.timer.At(Clock::now() + std::chrono::seconds(5), [this] { Beat(); });
  }

  Shared& shared_;
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  grpc::ClientContext context_;
  v1::LeaseRequest credit_;
  v1::LeaseResponse news_;
  uint64_t id_ = 0;
  Clock::time_point asked_;
  std::minstd_rand random_{std::random_device()()};
};

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) * 1e-6;
}

// Finished tasks of the past, straight into the database.
void AddKnown(Farm& farm, int count, const Digest& digest) {
  constexpr int kBatch = 50000;
  for (int begin = 0; begin < count; begin += kBatch) {
    const absl::Status status = farm.coordinator().writer().Run([&](store::Tables& tables) -> absl::Status {
      for (int i = begin; i < std::min(count, begin + kBatch); ++i) {
        const store::KnownTask known{{{"out", digest, 64}}, 1000, 1};
        const absl::Status inserted = tables.InsertKnown(TaskKey{Sha256Of("past" + std::to_string(i))}, known);
        if (!inserted.ok()) return inserted;
      }
      return absl::OkStatus();
    });
    if (!status.ok()) std::fprintf(stderr, "%s\n", status.ToString().c_str());
  }
}

void SubmitJobs(Farm& farm, const Flags& flags) {
  const auto client = farm.Client();
  const auto start = Clock::now();
  for (int i = 0; i < flags.jobs; ++i) {
    const SyntheticScene scene{flags.tasks / 5, 5, 1000, 0, 64, i + 1, false};
    const auto job = client->Submit(scene.Text(), {"job" + std::to_string(i), "", "", i % 10 == 0});
    if (!job.ok()) std::fprintf(stderr, "submit: %s\n", job.status().ToString().c_str());
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  std::printf("submitted %d jobs of %d tasks in %.1f s\n", flags.jobs, flags.tasks, seconds);
}

int Run(const Flags& flags) {
  Farm::Options options;
  options.folder = flags.folder;
  Farm farm(options);
  Shared shared;
  shared.flags = flags;
  const std::string bytes(64, 'x');
  shared.digest = DigestToBytes(Sha256Of(bytes));
  shared.size_bytes = std::ssize(bytes);
  UploadBlob(*farm.Connect(), Sha256Of(bytes), bytes).IgnoreError();
  if (flags.known > 0) AddKnown(farm, flags.known, Sha256Of(bytes));
  SubmitJobs(farm, flags);
  std::vector<std::shared_ptr<Connection>> connections;
  for (int i = 0; i < 16; ++i) connections.push_back(farm.Connect());
  std::vector<std::unique_ptr<Simulated>> workers;
  for (int i = 0; i < flags.workers; ++i) {
    workers.push_back(std::make_unique<Simulated>(shared, connections[i % 16]->channel(), i));
  }
  std::this_thread::sleep_for(std::chrono::seconds(3));
  shared.lease.Clear();
  shared.complete.Clear();
  const job::Stats before = farm.coordinator().GetStats();
  const double cpu = CpuSeconds();
  std::this_thread::sleep_for(std::chrono::seconds(flags.seconds));
  const job::Stats after = farm.coordinator().GetStats();
  std::printf("%zu workers registered, %zu leases held, %zu tasks ready, timer late by %.1f ms at most\n",
              after.workers, after.leases, after.ready, shared.timer.late_ms());
  shared.lease.Print("lease", flags.seconds);
  shared.complete.Print("complete", flags.seconds);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf(
      "%d workers, %zu tasks in memory, %lld completed, %.1f works a commit, %.2f cores (both sides), %ld MiB\n",
      flags.workers, after.tasks, static_cast<long long>(after.completed - before.completed),
      static_cast<double>(after.writes - before.writes) / static_cast<double>(after.commits - before.commits),
      (CpuSeconds() - cpu) / flags.seconds, usage.ru_maxrss / 1024);
  std::fflush(stdout);
  shared.stopping = true;
  shared.timer.Stop();
  for (const auto& worker : workers) worker->Stop();
  WaitFor([&] { return shared.calls == 0; });
  return 0;
}

}  // namespace
}  // namespace bakewell::test

int main(int argc, char** argv) {
  bakewell::test::Flags flags;
  CLI::App app("Load test of the coordinator");
  app.add_option("folder", flags.folder)->required();
  app.add_option("--workers", flags.workers);
  app.add_option("--jobs", flags.jobs);
  app.add_option("--tasks", flags.tasks);
  app.add_option("--run-ms", flags.run_ms, "simulated run time; 0: as fast as it goes");
  app.add_option("--seconds", flags.seconds);
  app.add_option("--known", flags.known, "finished tasks in the database beforehand");
  CLI11_PARSE(app, argc, argv);
  return bakewell::test::Run(flags);
}
