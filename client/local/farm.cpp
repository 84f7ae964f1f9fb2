#include "client/local/farm.h"

#include <limits>

#include "server/level/chart_task.h"

namespace bakewell {

namespace {

// Nobody here is far away, silent or slow in a way that another worker could mend: a process that was stopped for an
// hour goes on where it was.
constexpr std::chrono::hours kPatience(24 * 365);
constexpr double kAnyNumber = std::numeric_limits<double>::infinity();
constexpr int64_t kAnyBytes = int64_t{1} << 42;
// What one thread does in a task: small enough to report and to share out, large enough to cost nothing.
constexpr std::chrono::seconds kTaskOfAThread(2);

job::Options CoordinatorOptions(const std::filesystem::path& folder) {
  job::Options options;
  options.folder = folder;
  options.durability = store::Durability::kScratch;
  options.sched.heartbeat_timeout = options.sched.min_run_limit = options.sched.min_straggler = kPatience;
  options.sched.max_failures = 1;  // nobody else is there to try it
  options.io_threads = 2;
  return options;
}

WorkerOptions OptionsOfWorker(int threads) {
  WorkerOptions options;
  options.identity = {"embedded", "", threads, kAnyBytes, {}};
  // The second slot's task fills the threads that the end of the first one leaves idle.
  options.slots = std::min(threads, 2);
  options.max_blob_bytes = kAnyBytes;
  options.grace = std::chrono::milliseconds(0);
  return options;
}

}  // namespace

EmbeddedFarm::EmbeddedFarm(int threads, Progress& progress)
    : planner_({threads * kTaskOfAThread, kAnyNumber, kAnyNumber}),
      executor_({.threads = threads, .progress = &progress}) {}

absl::StatusOr<std::unique_ptr<EmbeddedFarm>> EmbeddedFarm::Start(const std::filesystem::path& folder, int threads,
                                                                  const std::string& layout, Progress& progress) {
  std::unique_ptr<EmbeddedFarm> farm(new EmbeddedFarm(threads, progress));
  BAKEWELL_RETURN_IF_ERROR(farm->Open(folder, threads, layout, progress));
  return farm;
}

absl::Status EmbeddedFarm::Open(const std::filesystem::path& folder, int threads, const std::string& layout,
                                Progress& progress) {
  BAKEWELL_ASSIGN_OR_RETURN(coordinator_, job::Coordinator::Open(CoordinatorOptions(folder), planner_));
  const ChartOptions charts{[&progress] { progress.Report("chart", 0, 1); },
                            [&progress] { progress.Report("chart", 1, 1); }, layout};
  charts_ = std::make_unique<job::LocalRunner>(*coordinator_, ChartTasks(charts), /*threads=*/1);
  rpc::ServerOptions options;
  options.max_blob_bytes = kAnyBytes;
  BAKEWELL_ASSIGN_OR_RETURN(server_, rpc::FarmServer::Start(*coordinator_, options));
  const auto connection = std::make_shared<Connection>(server_->InProcessChannel(), "");
  client_ = std::make_unique<FarmClient>(connection);
  WorkerOptions worker = OptionsOfWorker(threads);
  worker.undelivered = [this](const absl::Status& status) {
    const std::lock_guard lock(mutex_);
    undelivered_ = status;
  };
  worker_ = std::make_unique<Worker>(connection, executor_, std::move(worker));
  working_ = std::thread([this] { worker_->Run().IgnoreError(); });  // it is of this version, and has every right
  return absl::OkStatus();
}

EmbeddedFarm::~EmbeddedFarm() {
  if (worker_) worker_->Drain();
  if (working_.joinable()) working_.join();
  worker_.reset();
  client_.reset();
  server_.reset();
  charts_.reset();
  coordinator_.reset();
}

void EmbeddedFarm::HandOver(const v1::Job& job, const std::filesystem::path& folder) const {
  for (const v1::Artifact& artifact : job.artifacts()) {
    const auto digest = DigestFromBytes(artifact.digest());
    if (digest.ok()) coordinator_->blobs().Link(*digest, folder / artifact.name()).IgnoreError();
  }
}

absl::Status EmbeddedFarm::Trouble() {
  BAKEWELL_RETURN_IF_ERROR(coordinator_->writer().Trouble());
  const std::lock_guard lock(mutex_);
  return undelivered_;
}

}  // namespace bakewell
