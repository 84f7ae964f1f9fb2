#include "server/job/coordinator.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/base/caught.h"

namespace bakewell::job {

namespace {

int64_t SystemNowUs() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

sched::Time SteadyNow() {
  return std::chrono::duration_cast<sched::Time>(std::chrono::steady_clock::now().time_since_epoch());
}

void FillDefaults(Options& options) {
  if (!options.steady_now) options.steady_now = SteadyNow;
  if (!options.wall_now_us) options.wall_now_us = SystemNowUs;
  if (!options.log) options.log = [](std::string_view) {};
  if (options.keep_bytes == 0) options.keep_bytes = options.quota_bytes > 0 ? options.quota_bytes / 10 * 9 : INT64_MAX;
}

constexpr auto kTick = std::chrono::milliseconds(100);

// Nobody waits for ever for a job that is in the database and cannot run.
absl::Status FailUnrecovered(store::JobRow row, const absl::Status& why, int64_t now_us, store::Writer& writer) {
  row.state = store::JobState::kFailed;
  row.reason = absl::StrCat("it could not go on after a restart; submit it again: ", std::string(why.message()));
  row.code = static_cast<int>(why.code());
  row.finished_us = now_us;
  return writer.Run([&](store::Tables& tables) -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(tables.UpdateJob(row));
    return tables.DeleteStages(row.id);
  });
}

}  // namespace

struct Coordinator::Parts {
  std::unique_ptr<store::BlobStore> blobs;
  std::unique_ptr<store::Tables> reader;
  std::unique_ptr<store::Writer> writer;
  int64_t epoch = 0;
};

absl::StatusOr<std::unique_ptr<Coordinator>> Coordinator::Open(Options options, const plan::Planner& planner) {
  FillDefaults(options);
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  const std::filesystem::path path = options.folder / "farm.db";
  BAKEWELL_ASSIGN_OR_RETURN(auto blobs,
                            store::BlobStore::Open(options.folder, options.quota_bytes, options.durability));
  BAKEWELL_ASSIGN_OR_RETURN(auto tables, store::Tables::Open(path, options.durability));
  BAKEWELL_ASSIGN_OR_RETURN(auto reader, store::Tables::OpenReadOnly(path));
  auto writer = std::make_unique<store::Writer>(std::move(tables), options.durability);
  const auto learn = [&](const store::BlobRow& blob) { blobs->Learn(blob.digest, blob.size_bytes); };
  BAKEWELL_RETURN_IF_ERROR(reader->ForEachBlob(learn));
  int64_t epoch = 0;
  const auto start = [&](store::Tables& writing) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(epoch, writing.NextEpoch());
    return absl::OkStatus();
  };
  BAKEWELL_RETURN_IF_ERROR(writer->Run(start));
  std::unique_ptr<Coordinator> coordinator(
      new Coordinator(std::move(options), planner, {std::move(blobs), std::move(reader), std::move(writer), epoch}));
  BAKEWELL_RETURN_IF_ERROR(coordinator->Recover());
  coordinator->ticker_ = std::thread([raw = coordinator.get()] { raw->Tick(); });
  return coordinator;
}

Coordinator::Coordinator(Options options, const plan::Planner& planner, Parts parts)
    : options_(std::move(options)),
      planner_(planner),
      kinds_(planner.Kinds()),
      blobs_(std::move(parts.blobs)),
      reader_(std::move(parts.reader)),
      sched_(options_.sched, sched::LeaseToken{static_cast<uint64_t>(parts.epoch) << 32}),
      costs_(kinds_),
      // Worker ids carry the epoch as well, so that one from before a restart is never taken for another.
      next_worker_((static_cast<uint64_t>(parts.epoch) << 32) + 1),
      writer_(std::move(parts.writer)),
      collector_(options_, *writer_, *blobs_,
                 [this](const TaskKey& key) {
                   const Lock lock(mutex_);
                   return by_key_.contains(key);
                 }),
      io_(options_.io_threads) {}

Coordinator::~Coordinator() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  tick_.notify_all();
  if (ticker_.joinable()) ticker_.join();
  io_.Finish();
  writer_.reset();
}

void Coordinator::Tick() {
  for (;;) {
    {
      Lock lock(mutex_);
      tick_.wait_for(lock, kTick, [this] { return stopping_ || tick_now_; });
      tick_now_ = false;
      if (stopping_) return;
      sched_.Tick(Now());
      HandleEvents();
      Dispatch();
    }
    collector_.Tick(io_);
    NotifyWatchers();
  }
}

absl::Status Coordinator::Recover() {
  std::vector<store::JobRow> running;
  {
    const std::lock_guard lock(reader_mutex_);
    BAKEWELL_RETURN_IF_ERROR(
        costs_.Load(*reader_, [this](int kind, double ratio) { sched_.SetSpeedRatio(kind, ratio); }));
    BAKEWELL_ASSIGN_OR_RETURN(next_job_, reader_->LastJobId());
    ++next_job_;
    BAKEWELL_ASSIGN_OR_RETURN(running,
                              reader_->ListJobs({"", store::JobState::kRunning, INT64_MAX, /*limit=*/1 << 30}));
  }
  std::reverse(running.begin(), running.end());  // oldest first, as they were submitted
  for (const store::JobRow& row : running) {
    const absl::Status status = Caught([&] { return RecoverJob(row); });
    if (status.ok()) continue;
    options_.log(absl::StrCat("job ", row.id, " cannot go on: ", status.ToString()));
    BAKEWELL_RETURN_IF_ERROR(FailUnrecovered(row, status, WallNowUs(), *writer_));
  }
  return absl::OkStatus();
}

absl::Status Coordinator::RecoverJob(const store::JobRow& row) {
  std::vector<std::string> graphs;
  {
    const std::lock_guard lock(reader_mutex_);
    BAKEWELL_ASSIGN_OR_RETURN(graphs, reader_->Stages(row.id));
  }
  std::vector<Stage> stages;
  std::vector<plan::TaskGraph> before;
  for (const std::string& bytes : graphs) {
    BAKEWELL_ASSIGN_OR_RETURN(plan::TaskGraph graph, plan::ParseGraph(bytes));
    BAKEWELL_RETURN_IF_ERROR(plan::CheckGraph(graph, before));
    before.push_back(graph);
    BAKEWELL_ASSIGN_OR_RETURN(Stage stage, LookUp(std::move(graph)));
    stages.push_back(std::move(stage));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const store::AccountRow account, AccountOf(row.user));
  Activate(row, account.weight, std::move(stages));
  return absl::OkStatus();
}

uint64_t Coordinator::CapabilitiesOf(const std::vector<plan::Kind>& kinds) const {
  uint64_t bits = 0;
  for (const plan::Kind& kind : kinds) {
    const auto found = std::find(kinds_.begin(), kinds_.end(), kind);
    if (found != kinds_.end()) bits |= uint64_t{1} << (found - kinds_.begin());
  }
  return bits;
}

void Coordinator::RecordBlob(const Digest& digest, int64_t size_bytes, Done done) {
  const store::BlobRow row{digest, size_bytes, 0, WallNowUs()};
  writer_->Submit([row](store::Tables& tables) { return tables.InsertBlob(row); }, std::move(done));
}

absl::StatusOr<std::optional<store::TokenRow>> Coordinator::FindToken(const Digest& hash) {
  const std::lock_guard lock(reader_mutex_);
  return reader_->FindToken(hash);
}

absl::StatusOr<int64_t> Coordinator::CountTokens() {
  const std::lock_guard lock(reader_mutex_);
  return reader_->CountTokens();
}

Stats Coordinator::GetStats() {
  Stats stats;
  {
    const Lock lock(mutex_);
    stats = stats_;
    stats.ready = sched_.ready();
    stats.leases = sched_.leases();
    stats.workers = workers_.size();
    stats.running_jobs = jobs_.size();
    stats.tasks = sched_.tasks();
  }
  stats.store_bytes = blobs_->total_bytes();
  stats.store_quota_bytes = blobs_->quota_bytes();
  stats.blobs = blobs_->count();
  stats.corrupt_blobs = blobs_->corrupt();
  stats.commits = writer_->commits();
  stats.writes = writer_->works();
  stats.write_backlog = writer_->backlog();
  const absl::Status trouble = writer_->Trouble();
  if (!trouble.ok()) stats.trouble = std::string(trouble.message());
  return stats;
}

}  // namespace bakewell::job
