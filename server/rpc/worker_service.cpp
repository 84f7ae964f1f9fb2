#include "server/rpc/worker_service.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "server/rpc/lease_stream.h"

namespace bakewell::rpc {

namespace {

// A third of the scheduler's heartbeat timeout: two may be lost.
constexpr int kHeartbeatsPerTimeout = 3;
constexpr size_t kMaxReasonBytes = 4 << 10;
constexpr int kMaxHeld = 1024;
constexpr int64_t kMaxRunUs = int64_t{30} * 24 * 3600 * 1'000'000;  // sums of what a liar says do not overflow

std::string KindNames(const std::vector<plan::Kind>& kinds) {
  std::string names;
  for (const plan::Kind& kind : kinds) {
    absl::StrAppend(&names, names.empty() ? "" : ", ", kind.kind, " v", kind.code_version);
  }
  return names;
}

absl::Status CheckRegister(const v1::RegisterRequest& request) {
  if (!IsPlainName(request.name())) return absl::InvalidArgumentError("name must be 1 to 64 of [A-Za-z0-9_.-]");
  if (request.cores() < 1 || request.memory_bytes() < 1) {
    return absl::InvalidArgumentError("cores and memory_bytes must be positive");
  }
  if (request.capabilities_size() > 256 || request.held_size() > kMaxHeld || request.isa().size() > 256) {
    return absl::InvalidArgumentError("too many capabilities or held tasks");
  }
  return absl::OkStatus();
}

absl::StatusOr<TaskKey> KeyFrom(const std::string& bytes) {
  BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(bytes));
  return TaskKey{digest};
}

absl::Status RegisterWorker(job::Coordinator& coordinator, const v1::RegisterRequest& request,
                            std::chrono::microseconds heartbeat, v1::RegisterResponse& response) {
  BAKEWELL_RETURN_IF_ERROR(CheckRegister(request));
  std::vector<plan::Kind> kinds;
  for (const v1::Capability& one : request.capabilities()) kinds.push_back({one.kind(), one.code_version()});
  const uint64_t capabilities = coordinator.CapabilitiesOf(kinds);
  if (capabilities == 0) {
    return absl::FailedPreconditionError(absl::StrCat("the coordinator uses ", KindNames(coordinator.kinds()),
                                                      "; this worker runs ", KindNames(kinds),
                                                      ": install the same bakewell"));
  }
  std::vector<TaskKey> held;
  for (const v1::HeldTask& task : request.held()) {
    BAKEWELL_ASSIGN_OR_RETURN(const TaskKey key, KeyFrom(task.key()));
    held.push_back(key);
  }
  const sched::WorkerId id =
      coordinator.AddWorker({request.name(), request.isa(), request.cores(), request.memory_bytes(), capabilities});
  for (const job::TaskLease& lease : coordinator.Adopt(id, held)) FillLease(lease, *response.add_adopted());
  response.set_worker_id(static_cast<uint64_t>(id));
  response.set_heartbeat_us(heartbeat.count());
  return absl::OkStatus();
}

absl::StatusOr<job::CompletedTask> CompletedFrom(const v1::CompleteRequest& request) {
  if (static_cast<size_t>(request.outputs_size()) > kMaxTaskOutputs) {
    return absl::InvalidArgumentError("too many outputs");
  }
  job::CompletedTask task{sched::WorkerId{request.worker_id()},
                          sched::LeaseToken{request.token()},
                          {},
                          {},
                          std::chrono::microseconds(std::clamp<int64_t>(request.run_us(), 0, kMaxRunUs))};
  BAKEWELL_ASSIGN_OR_RETURN(task.key, KeyFrom(request.key()));
  for (const v1::TaskOutput& output : request.outputs()) {
    if (!IsPlainPath(output.name())) return absl::InvalidArgumentError("an output's name must be a plain path");
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(output.digest()));
    task.outputs.push_back({output.name(), digest, output.size_bytes()});
  }
  return task;
}

absl::StatusOr<job::FailedTask> FailedFrom(const v1::FailRequest& request) {
  const auto code = request.code() > 0 && request.code() <= 16 ? static_cast<absl::StatusCode>(request.code())
                                                               : absl::StatusCode::kUnknown;
  job::FailedTask task{sched::WorkerId{request.worker_id()},
                       sched::LeaseToken{request.token()},
                       {},
                       absl::Status(code, request.reason().substr(0, kMaxReasonBytes)),
                       {}};
  BAKEWELL_ASSIGN_OR_RETURN(task.key, KeyFrom(request.key()));
  for (const std::string& bytes : request.missing_inputs()) {
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(bytes));
    task.missing_inputs.push_back(digest);
  }
  return task;
}

}  // namespace

grpc::ServerUnaryReactor* WorkerService::Register(grpc::CallbackServerContext* context,
                                                  const v1::RegisterRequest* request, v1::RegisterResponse* response) {
  return AtOnce(services_, context, Any(Scope::kWork), [&](const Caller&) {
    const auto heartbeat = services_.coordinator.options().sched.heartbeat_timeout / kHeartbeatsPerTimeout;
    return RegisterWorker(services_.coordinator, *request, heartbeat, *response);
  });
}

grpc::ServerBidiReactor<v1::LeaseRequest, v1::LeaseResponse>* WorkerService::Lease(
    grpc::CallbackServerContext* context) {
  return new LeaseStream(services_, context->peer(), services_.auth.Check(*context, Any(Scope::kWork)).status());
}

grpc::ServerUnaryReactor* WorkerService::Heartbeat(grpc::CallbackServerContext* context,
                                                   const v1::HeartbeatRequest* request, v1::HeartbeatResponse*) {
  return AtOnce(services_, context, Any(Scope::kWork), [&](const Caller&) {
    const bool known = services_.coordinator.Heartbeat(sched::WorkerId{request->worker_id()});
    return known ? absl::OkStatus() : absl::FailedPreconditionError("this worker is not known: register again");
  });
}

grpc::ServerUnaryReactor* WorkerService::Complete(grpc::CallbackServerContext* context,
                                                  const v1::CompleteRequest* request, v1::CompleteResponse*) {
  auto* reactor = context->DefaultReactor();
  const auto caller = services_.auth.Check(*context, Any(Scope::kWork));
  const auto task = caller.ok() ? CompletedFrom(*request) : caller.status();
  if (!task.ok()) {
    reactor->Finish(services_.Answer(context->peer(), task.status()));
    return reactor;
  }
  services_.coordinator.Complete(*task, [reactor](const absl::Status& status) { reactor->Finish(ToGrpc(status)); });
  return reactor;
}

grpc::ServerUnaryReactor* WorkerService::Fail(grpc::CallbackServerContext* context, const v1::FailRequest* request,
                                              v1::FailResponse*) {
  return AtOnce(services_, context, Any(Scope::kWork), [&](const Caller&) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const job::FailedTask task, FailedFrom(*request));
    services_.coordinator.Fail(task);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* WorkerService::Release(grpc::CallbackServerContext* context,
                                                 const v1::ReleaseRequest* request, v1::ReleaseResponse*) {
  return AtOnce(services_, context, Any(Scope::kWork), [&](const Caller&) -> absl::Status {
    const sched::WorkerId worker{request->worker_id()};
    std::vector<std::pair<sched::LeaseToken, TaskKey>> leases;
    for (const v1::HeldLease& lease : request->leases()) {
      BAKEWELL_ASSIGN_OR_RETURN(const TaskKey key, KeyFrom(lease.key()));
      leases.emplace_back(sched::LeaseToken{lease.token()}, key);
    }
    services_.coordinator.Release(worker, leases);
    if (request->goodbye()) services_.coordinator.RemoveWorker(worker);
    return absl::OkStatus();
  });
}

}  // namespace bakewell::rpc
