#include "server/rpc/admin_service.h"

#include <absl/strings/str_cat.h>

#include "server/rpc/bake_service.h"

namespace bakewell::rpc {

namespace {

constexpr int64_t kDefaultGraceUs = 3'600'000'000;
constexpr int kFailuresShown = 20;

void FillStatus(const job::Stats& stats, v1::StatusResponse& response) {
  response.set_ready(static_cast<int64_t>(stats.ready));
  response.set_leases(static_cast<int64_t>(stats.leases));
  response.set_workers(static_cast<int64_t>(stats.workers));
  response.set_running_jobs(static_cast<int64_t>(stats.running_jobs));
  response.set_store_bytes(stats.store_bytes);
  response.set_store_quota_bytes(stats.store_quota_bytes);
  response.set_tasks_completed(stats.completed);
  response.set_tasks_known(stats.known);
  response.set_tasks_failed(stats.failed);
  response.set_conflicts(stats.conflicts);
  response.set_corrupt_blobs(static_cast<int64_t>(stats.corrupt_blobs));
  response.set_trouble(stats.trouble);
}

}  // namespace

grpc::ServerUnaryReactor* AdminService::ListWorkers(grpc::CallbackServerContext* context, const v1::ListWorkersRequest*,
                                                    v1::ListWorkersResponse* response) {
  return AtOnce(services_, context, Any(Scope::kRead, Scope::kAdmin), [&](const Caller&) {
    for (const job::WorkerView& view : services_.coordinator.Workers()) {
      v1::WorkerState& worker = *response->add_workers();
      worker.set_id(static_cast<uint64_t>(view.id));
      worker.set_name(view.about.name);
      worker.set_cores(view.about.cores);
      worker.set_memory_bytes(view.about.memory_bytes);
      worker.set_isa(view.about.isa);
      worker.set_draining(view.draining);
      worker.set_leases(static_cast<int32_t>(view.leases));
      worker.set_tasks_done(view.tasks_done);
      worker.set_tasks_failed(view.tasks_failed);
      worker.set_seen_us_ago(view.seen_ago.count());
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* AdminService::Status(grpc::CallbackServerContext* context, const v1::StatusRequest*,
                                               v1::StatusResponse* response) {
  return OnIo(services_, context, Any(Scope::kRead, Scope::kAdmin), [=, this](const Caller& caller) -> absl::Status {
    FillStatus(services_.coordinator.GetStats(), *response);
    if (!caller.Has(Scope::kAdmin)) return absl::OkStatus();
    BAKEWELL_ASSIGN_OR_RETURN(const auto failures, services_.coordinator.Failures(0, kFailuresShown));
    for (const store::FailureRow& row : failures) {
      v1::Failure& failure = *response->add_failures();
      failure.set_at_us(row.at_us);
      failure.set_job_id(row.job);
      failure.set_kind(row.kind);
      failure.set_worker(row.worker);
      failure.set_reason(row.reason);
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* AdminService::Drain(grpc::CallbackServerContext* context, const v1::DrainRequest* request,
                                              v1::DrainResponse*) {
  return AtOnce(services_, context, Any(Scope::kAdmin), [&](const Caller&) {
    const bool known = services_.coordinator.Drain(sched::WorkerId{request->worker_id()}, request->draining());
    return known ? absl::OkStatus() : absl::NotFoundError(absl::StrCat("no worker ", request->worker_id()));
  });
}

grpc::ServerUnaryReactor* AdminService::SetPriority(grpc::CallbackServerContext* context,
                                                    const v1::SetPriorityRequest* request, v1::Job* response) {
  return OnIo(services_, context, Any(Scope::kAdmin), [=, this](const Caller&) -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(services_.coordinator.SetPriority(request->job_id(), request->priority()));
    BAKEWELL_ASSIGN_OR_RETURN(const job::JobView view, services_.coordinator.Get(request->job_id()));
    *response = MessageOf(view);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* AdminService::SetQuota(grpc::CallbackServerContext* context,
                                                 const v1::SetQuotaRequest* request, v1::SetQuotaResponse*) {
  return OnIo(services_, context, Any(Scope::kAdmin), [=, this](const Caller&) -> absl::Status {
    const bool sound = IsPlainName(request->user()) && request->weight() >= 1 && request->weight() <= 1000 &&
                       request->max_jobs() >= 0 && request->max_scene_bytes() >= 0 && request->max_tasks() >= 0;
    if (!sound) return absl::InvalidArgumentError("a quota has a plain user, a weight from 1 to 1000, limits from 0");
    return services_.coordinator.SetAccount(
        {request->user(), request->weight(), request->max_jobs(), request->max_scene_bytes(), request->max_tasks()});
  });
}

grpc::ServerUnaryReactor* AdminService::CollectGarbage(grpc::CallbackServerContext* context,
                                                       const v1::CollectGarbageRequest* request,
                                                       v1::CollectGarbageResponse* response) {
  return OnIo(services_, context, Any(Scope::kAdmin), [=, this](const Caller&) -> absl::Status {
    const int64_t grace_us = request->grace_us() > 0 ? request->grace_us() : kDefaultGraceUs;
    BAKEWELL_ASSIGN_OR_RETURN(const store::CollectReport report,
                              services_.coordinator.collector().Collect(request->target_bytes(), grace_us));
    response->set_results(report.results);
    response->set_blobs(report.blobs);
    response->set_bytes(report.bytes);
    return absl::OkStatus();
  });
}

}  // namespace bakewell::rpc
