#include "client/rpc/farm_client.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <thread>

#include "proto/bakewell/v1/admin.grpc.pb.h"
#include "proto/bakewell/v1/bake.grpc.pb.h"
#include "proto/rpc/status.h"
#include "proto/rpc/transfer.h"

namespace bakewell {

namespace {

namespace fs = std::filesystem;

constexpr auto kCall = std::chrono::seconds(30);
// Planning a large scene at Submit takes a while.
constexpr auto kSubmitCall = std::chrono::minutes(5);

bool WorthRetrying(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status);
}

std::string RandomKey() {
  std::random_device random;
  std::string bytes;
  for (int i = 0; i < 8; ++i) absl::StrAppend(&bytes, random(), "-");
  return Sha256Of(bytes).Hex().substr(0, 32);
}

v1::SubmitRequest RequestOf(const Digest& scene, const SubmitOptions& options) {
  v1::SubmitRequest request;
  request.set_client_key(options.client_key.empty() ? RandomKey() : options.client_key);
  request.set_name(options.name);
  request.set_scene(DigestToBytes(scene));
  request.set_settings(options.settings);
  request.set_priority(options.interactive ? v1::INTERACTIVE : v1::BATCH);
  return request;
}

absl::StatusOr<Digest> DigestOfFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::NotFoundError(path.string());
  Sha256 hash;
  std::string block(64 << 10, '\0');
  while (file.read(block.data(), std::ssize(block)) || file.gcount() > 0) {
    hash.Update(std::as_bytes(std::span(block.data(), static_cast<size_t>(file.gcount()))));
  }
  return hash.Finish();
}

absl::Status SyncAndRename(const fs::path& from, const fs::path& to) {
  const int file = open(from.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  std::error_code error;
  if (synced) fs::rename(from, to, error);
  if (synced && !error) return absl::OkStatus();
  return absl::UnknownError(absl::StrCat("cannot write ", to.string(), ": is the disk full?"));
}

bool HasEnded(const v1::Job& job) { return job.state() != v1::RUNNING && job.state() != v1::JOB_STATE_UNSPECIFIED; }

}  // namespace

struct FarmClient::Stubs {
  std::unique_ptr<v1::BakeService::Stub> bake;
  std::unique_ptr<v1::AdminService::Stub> admin;
};

FarmClient::FarmClient(std::shared_ptr<Connection> connection, std::chrono::milliseconds patience)
    : connection_(std::move(connection)),
      patience_(patience),
      stubs_(new Stubs{v1::BakeService::NewStub(connection_->channel()),
                       v1::AdminService::NewStub(connection_->channel())}) {}

FarmClient::~FarmClient() = default;

std::chrono::milliseconds FarmClient::CallTime() const {
  return std::clamp<std::chrono::milliseconds>(patience_, std::chrono::seconds(1), kCall);
}

absl::Status FarmClient::Retry(const std::function<absl::Status()>& call) {
  const auto give_up = std::chrono::steady_clock::now() + patience_;
  auto pause = std::chrono::milliseconds(50);
  for (;;) {
    const absl::Status status = call();
    if (!WorthRetrying(status) || std::chrono::steady_clock::now() > give_up) return status;
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(2000));
  }
}

absl::Status FarmClient::UploadScene(std::string_view scene, const Digest& digest) {
  return Retry([&]() -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<Digest> missing, FindMissing(*connection_, {digest}));
    return missing.empty() ? absl::OkStatus() : UploadBlob(*connection_, digest, scene);
  });
}

absl::StatusOr<v1::SubmitResponse> FarmClient::Submit(std::string_view scene, const SubmitOptions& options) {
  const Digest digest = Sha256Of(scene);
  const v1::SubmitRequest request = RequestOf(digest, options);
  v1::SubmitResponse response;
  const auto submit = [&]() -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(UploadScene(scene, digest));
    return Retry([&] {
      grpc::ClientContext context;
      connection_->Prepare(context, kSubmitCall);
      return FromGrpc(stubs_->bake->Submit(&context, request, &response));
    });
  };
  absl::Status status = submit();
  if (absl::IsNotFound(status)) status = submit();  // the scene was collected meanwhile
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::StatusOr<v1::EstimateResponse> FarmClient::Estimate(std::string_view scene, const SubmitOptions& options) {
  const Digest digest = Sha256Of(scene);
  BAKEWELL_RETURN_IF_ERROR(UploadScene(scene, digest));
  const v1::SubmitRequest request = RequestOf(digest, options);
  v1::EstimateResponse response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, kSubmitCall);
    return FromGrpc(stubs_->bake->Estimate(&context, request, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::StatusOr<v1::Job> FarmClient::Get(int64_t job) {
  v1::GetRequest request;
  request.set_job_id(job);
  v1::Job response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->bake->Get(&context, request, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::StatusOr<std::vector<v1::Job>> FarmClient::List(const v1::ListRequest& filter, int limit) {
  std::vector<v1::Job> jobs;
  v1::ListRequest request = filter;
  do {
    v1::ListResponse response;
    const absl::Status status = Retry([&] {
      grpc::ClientContext context;
      connection_->Prepare(context, CallTime());
      return FromGrpc(stubs_->bake->List(&context, request, &response));
    });
    BAKEWELL_RETURN_IF_ERROR(status);
    jobs.insert(jobs.end(), response.jobs().begin(), response.jobs().end());
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty() && std::ssize(jobs) < limit);
  if (std::ssize(jobs) > limit) jobs.resize(static_cast<size_t>(limit));
  return jobs;
}

absl::StatusOr<v1::Job> FarmClient::Cancel(int64_t job) {
  v1::CancelRequest request;
  request.set_job_id(job);
  v1::Job response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->bake->Cancel(&context, request, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::Status FarmClient::WatchOnce(int64_t job, const std::function<bool(const v1::Job&)>& changed, v1::Job& last) {
  v1::WatchRequest request;
  request.set_job_id(job);
  grpc::ClientContext context;
  connection_->PrepareStream(context);
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return absl::CancelledError("not watched any more");
    watching_.insert(&context);
  }
  const auto reader = stubs_->bake->Watch(&context, request);
  v1::Job now;
  bool wanted = true;
  while (wanted && reader->Read(&now)) {
    last = now;
    wanted = changed(now);
  }
  if (!wanted) context.TryCancel();
  const absl::Status status = FromGrpc(reader->Finish());
  {
    const std::lock_guard lock(mutex_);
    watching_.erase(&context);
    wanted = wanted && !stopped_;
  }
  if (!wanted) return absl::CancelledError("not watched any more");
  if (status.ok() && !HasEnded(last)) return absl::UnavailableError("the coordinator went away");
  return status;
}

void FarmClient::StopWatching() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (grpc::ClientContext* context : watching_) context->TryCancel();
}

absl::StatusOr<v1::Job> FarmClient::Watch(int64_t job, const std::function<bool(const v1::Job&)>& changed) {
  v1::Job last;
  auto heard = std::chrono::steady_clock::now();
  const auto note = [&](const v1::Job& now) {
    heard = std::chrono::steady_clock::now();
    return changed(now);
  };
  // Patience counts from the last sign of life, however long the job takes.
  for (;;) {
    const absl::Status status = WatchOnce(job, note, last);
    if (HasEnded(last)) return last;
    if (!WorthRetrying(status) || std::chrono::steady_clock::now() - heard > patience_) return status;
    // Waits until the coordinator is there again; then the stream is opened anew.
    BAKEWELL_RETURN_IF_ERROR(Get(job).status());
  }
}

absl::Status FarmClient::FetchOnce(int64_t job, const std::string& name, const fs::path& part) {
  std::error_code error;
  const auto size = fs::file_size(part, error);
  v1::FetchRequest request;
  request.set_job_id(job);
  request.set_name(name);
  request.set_offset(error ? 0 : static_cast<int64_t>(size));
  std::ofstream file(part, std::ios::binary | std::ios::app);
  grpc::ClientContext context;
  connection_->Prepare(context, std::chrono::minutes(30));
  const auto reader = stubs_->bake->Fetch(&context, request);
  v1::FetchChunk chunk;
  while (file && reader->Read(&chunk)) file << chunk.data();
  file.flush();
  if (!file) context.TryCancel();
  const absl::Status status = FromGrpc(reader->Finish());
  if (!file) return absl::UnknownError(absl::StrCat("cannot write ", part.string(), ": is the disk full?"));
  return status;
}

absl::Status FarmClient::Fetch(int64_t job, const v1::Artifact& artifact, const fs::path& folder) {
  if (!IsPlainPath(artifact.name())) {
    return absl::DataLossError(absl::StrCat("refusing the artifact name '", artifact.name(), "'"));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const Digest wanted, DigestFromBytes(artifact.digest()));
  const fs::path path = folder / artifact.name(), part = path.string() + ".part";
  const auto there = DigestOfFile(path);
  if (there.ok() && *there == wanted) return absl::OkStatus();
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  // What is left of an earlier try may be longer or other than it should be: then it is fetched once more from nothing.
  for (int tried = 0; tried < 2; ++tried) {
    const absl::Status status = Retry([&] { return FetchOnce(job, artifact.name(), part); });
    if (!status.ok() && !absl::IsOutOfRange(status)) return status;
    const auto got = DigestOfFile(part);
    if (got.ok() && *got == wanted) return SyncAndRename(part, path);
    fs::remove(part, error);
  }
  return absl::DataLossError(absl::StrCat("artifact ", artifact.name(), ": other bytes came twice"));
}

absl::Status FarmClient::FetchAll(const v1::Job& job, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  for (const v1::Artifact& artifact : job.artifacts()) {
    BAKEWELL_RETURN_IF_ERROR(Fetch(job.id(), artifact, folder));
  }
  return absl::OkStatus();
}

absl::Status FarmClient::FetchPreview(int64_t job, const v1::Preview& preview, const fs::path& folder) {
  if (!IsPlainPath(preview.name())) {
    return absl::DataLossError(absl::StrCat("refusing the name '", preview.name(), "' of a preview"));
  }
  const fs::path path = folder / preview.name(), part = path.string() + ".part";
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  // It may have grown since an earlier try: always the whole.
  const absl::Status status = Retry([&] {
    fs::remove(part, error);
    return FetchOnce(job, preview.name(), part);
  });
  if (status.ok()) return SyncAndRename(part, path);
  fs::remove(part, error);
  return status;
}

absl::StatusOr<v1::ListWorkersResponse> FarmClient::Workers() {
  v1::ListWorkersResponse response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->admin->ListWorkers(&context, {}, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::StatusOr<v1::StatusResponse> FarmClient::Status() {
  v1::StatusResponse response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->admin->Status(&context, {}, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

absl::Status FarmClient::DrainWorker(uint64_t worker, bool draining) {
  v1::DrainRequest request;
  request.set_worker_id(worker);
  request.set_draining(draining);
  return Retry([&] {
    v1::DrainResponse response;
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->admin->Drain(&context, request, &response));
  });
}

absl::Status FarmClient::SetPriority(int64_t job, int priority) {
  v1::SetPriorityRequest request;
  request.set_job_id(job);
  request.set_priority(priority);
  return Retry([&] {
    v1::Job response;
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->admin->SetPriority(&context, request, &response));
  });
}

absl::Status FarmClient::SetQuota(const v1::SetQuotaRequest& quota) {
  return Retry([&] {
    v1::SetQuotaResponse response;
    grpc::ClientContext context;
    connection_->Prepare(context, CallTime());
    return FromGrpc(stubs_->admin->SetQuota(&context, quota, &response));
  });
}

absl::StatusOr<v1::CollectGarbageResponse> FarmClient::CollectGarbage(int64_t target_bytes,
                                                                      std::chrono::microseconds grace) {
  v1::CollectGarbageRequest request;
  request.set_target_bytes(target_bytes);
  request.set_grace_us(grace.count());
  v1::CollectGarbageResponse response;
  const absl::Status status = Retry([&] {
    grpc::ClientContext context;
    connection_->Prepare(context, std::chrono::minutes(5));
    return FromGrpc(stubs_->admin->CollectGarbage(&context, request, &response));
  });
  BAKEWELL_RETURN_IF_ERROR(status);
  return response;
}

}  // namespace bakewell
