#include "worker/rpc/farm_link.h"

#include "proto/bakewell/v1/worker.grpc.pb.h"
#include "proto/rpc/status.h"

namespace bakewell {

namespace {

constexpr auto kCall = std::chrono::seconds(20);

std::unique_ptr<v1::WorkerService::Stub> StubOf(const Connection& connection) {
  return v1::WorkerService::NewStub(connection.channel());
}

absl::StatusOr<LeasedTask> LeaseFrom(const v1::TaskLease& message) {
  LeasedTask lease;
  lease.token = message.token();
  lease.memory_bytes = message.memory_bytes();
  BAKEWELL_ASSIGN_OR_RETURN(lease.key.digest, DigestFromBytes(message.key()));
  BAKEWELL_ASSIGN_OR_RETURN(lease.spec, ParseSpec(message.spec()));
  return lease;
}

// Leases that cannot be read are left to run out; that is another version's coordinator, which Register refuses.
template <typename Messages>
std::vector<LeasedTask> LeasesFrom(const Messages& messages) {
  std::vector<LeasedTask> leases;
  for (const v1::TaskLease& message : messages) {
    auto lease = LeaseFrom(message);
    if (lease.ok()) leases.push_back(*std::move(lease));
  }
  return leases;
}

}  // namespace

struct FarmLink::Stream {
  grpc::ClientContext context;
  std::unique_ptr<v1::WorkerService::Stub> stub;
  std::unique_ptr<grpc::ClientReaderWriter<v1::LeaseRequest, v1::LeaseResponse>> calls;
  std::mutex writing;
};

FarmLink::FarmLink(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}
FarmLink::~FarmLink() = default;

absl::StatusOr<Registration> FarmLink::Register(const WorkerIdentity& identity, const std::vector<TaskKey>& held) {
  v1::RegisterRequest request;
  request.set_name(identity.name);
  request.set_cores(identity.cores);
  request.set_memory_bytes(identity.memory_bytes);
  request.set_isa(identity.isa);
  for (const TaskKind& kind : identity.kinds) {
    v1::Capability& capability = *request.add_capabilities();
    capability.set_kind(kind.kind);
    capability.set_code_version(kind.code_version);
  }
  for (const TaskKey& key : held) request.add_held()->set_key(DigestToBytes(key.digest));
  v1::RegisterResponse response;
  grpc::ClientContext context;
  connection_->Prepare(context, std::chrono::seconds(5));
  BAKEWELL_RETURN_IF_ERROR(FromGrpc(StubOf(*connection_)->Register(&context, request, &response)));
  return Registration{response.worker_id(), std::chrono::microseconds(response.heartbeat_us()),
                      LeasesFrom(response.adopted())};
}

absl::Status FarmLink::Heartbeat(uint64_t worker_id) {
  v1::HeartbeatRequest request;
  request.set_worker_id(worker_id);
  v1::HeartbeatResponse response;
  grpc::ClientContext context;
  connection_->Prepare(context, std::chrono::seconds(3));
  return FromGrpc(StubOf(*connection_)->Heartbeat(&context, request, &response));
}

absl::Status FarmLink::Complete(uint64_t worker_id, const LeasedTask& task, const TaskOutputs& outputs,
                                std::chrono::microseconds run) {
  v1::CompleteRequest request;
  request.set_worker_id(worker_id);
  request.set_token(task.token);
  request.set_key(DigestToBytes(task.key.digest));
  request.set_run_us(run.count());
  for (const TaskOutput& output : outputs) {
    v1::TaskOutput& message = *request.add_outputs();
    message.set_name(output.name);
    message.set_digest(DigestToBytes(output.digest));
    message.set_size_bytes(output.size_bytes);
  }
  v1::CompleteResponse response;
  grpc::ClientContext context;
  connection_->Prepare(context, kCall);
  return FromGrpc(StubOf(*connection_)->Complete(&context, request, &response));
}

absl::Status FarmLink::Fail(uint64_t worker_id, const LeasedTask& task, const absl::Status& status,
                            const std::vector<Digest>& missing_inputs) {
  v1::FailRequest request;
  request.set_worker_id(worker_id);
  request.set_token(task.token);
  request.set_key(DigestToBytes(task.key.digest));
  request.set_code(static_cast<int32_t>(status.code()));
  request.set_reason(std::string(status.message().substr(0, 4096)));
  for (const Digest& digest : missing_inputs) request.add_missing_inputs(DigestToBytes(digest));
  v1::FailResponse response;
  grpc::ClientContext context;
  connection_->Prepare(context, kCall);
  return FromGrpc(StubOf(*connection_)->Fail(&context, request, &response));
}

absl::Status FarmLink::Release(uint64_t worker_id, const std::vector<std::pair<uint64_t, TaskKey>>& leases,
                               bool goodbye) {
  v1::ReleaseRequest request;
  request.set_worker_id(worker_id);
  request.set_goodbye(goodbye);
  for (const auto& [token, key] : leases) {
    v1::HeldLease& lease = *request.add_leases();
    lease.set_token(token);
    lease.set_key(DigestToBytes(key.digest));
  }
  v1::ReleaseResponse response;
  grpc::ClientContext context;
  connection_->Prepare(context, std::chrono::seconds(2));
  return FromGrpc(StubOf(*connection_)->Release(&context, request, &response));
}

absl::Status FarmLink::Listen(uint64_t worker_id, int credit, const std::function<void(LeaseNews)>& take) {
  const auto stream = std::make_shared<Stream>();
  connection_->PrepareStream(stream->context);
  stream->stub = StubOf(*connection_);
  stream->calls = stream->stub->Lease(&stream->context);
  v1::LeaseRequest first;
  first.set_worker_id(worker_id);
  first.set_add_credit(credit);
  std::unique_lock writing(stream->writing);  // what AddCredit writes comes after it
  {
    const std::lock_guard lock(mutex_);
    if (hung_up_for_good_) stream->context.TryCancel();
    stream_ = stream;
  }
  const bool opened = stream->calls->Write(first);
  writing.unlock();
  if (opened) {
    v1::LeaseResponse response;
    while (stream->calls->Read(&response)) {
      const auto& revoked = response.revoked();
      take({LeasesFrom(response.leases()), {revoked.begin(), revoked.end()}, response.drain(), response.superseded()});
    }
  }
  {
    const std::lock_guard lock(mutex_);
    stream_.reset();
  }
  // A write of AddCredit may be under way; the call ends after it.
  writing.lock();
  return FromGrpc(stream->calls->Finish());
}

void FarmLink::AddCredit(int credit) {
  std::shared_ptr<Stream> stream;
  {
    const std::lock_guard lock(mutex_);
    stream = stream_;
  }
  if (!stream) return;
  v1::LeaseRequest request;
  request.set_add_credit(credit);
  const std::lock_guard writing(stream->writing);
  stream->calls->Write(request);  // a stream that broke is noticed by its reader
}

void FarmLink::HangUp() {
  const std::lock_guard lock(mutex_);
  if (stream_) stream_->context.TryCancel();
}

void FarmLink::HangUpForGood() {
  const std::lock_guard lock(mutex_);
  hung_up_for_good_ = true;
  if (stream_) stream_->context.TryCancel();
}

}  // namespace bakewell
