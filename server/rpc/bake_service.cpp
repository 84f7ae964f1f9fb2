#include "server/rpc/bake_service.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include "server/rpc/blob_service.h"
#include "server/rpc/watch_stream.h"

namespace bakewell::rpc {

namespace {

constexpr int kMaxPage = 1000;
constexpr int kMaxWatches = 4096;

absl::StatusOr<job::SubmitRequest> RequestOf(const Caller& caller, const v1::SubmitRequest& message) {
  job::SubmitRequest request;
  request.user = caller.user;
  request.client_key = message.client_key();
  request.name = message.name();
  request.settings = message.settings();
  request.priority = message.priority() == v1::INTERACTIVE ? sched::kInteractive : sched::kBatch;
  BAKEWELL_ASSIGN_OR_RETURN(request.scene, DigestFromBytes(message.scene()));
  return request;
}

absl::StatusOr<store::JobFilter> FilterOf(const Caller& caller, const v1::ListRequest& request) {
  store::JobFilter filter;
  filter.user = caller.Has(Scope::kAdmin) ? request.user() : caller.user;
  if (!v1::JobState_IsValid(request.state())) {
    return absl::InvalidArgumentError(absl::StrCat("no state ", static_cast<int>(request.state())));
  }
  if (request.state() != v1::JOB_STATE_UNSPECIFIED) {
    filter.state = static_cast<store::JobState>(request.state() - v1::RUNNING);
  }
  if (request.page_size() < 0 || request.page_size() > kMaxPage) {
    return absl::InvalidArgumentError(absl::StrCat("page_size must be from 0 to ", kMaxPage));
  }
  filter.limit = request.page_size() == 0 ? 100 : request.page_size();
  if (!request.page_token().empty() && !absl::SimpleAtoi(request.page_token(), &filter.below_id)) {
    return absl::InvalidArgumentError("page_token is not one of ours");
  }
  return filter;
}

}  // namespace

v1::Job MessageOf(const job::JobView& view) {
  v1::Job message;
  message.set_id(view.row.id);
  message.set_user(view.row.user);
  message.set_name(view.row.name);
  message.set_state(static_cast<v1::JobState>(static_cast<int>(view.row.state) + v1::RUNNING));
  if (view.row.state != store::JobState::kRunning) {
    message.set_reason(view.row.reason);
    message.set_code(view.row.code);
  }
  message.set_priority(view.row.priority);
  message.set_scene(DigestToBytes(view.row.scene));
  message.set_submitted_us(view.row.submitted_us);
  message.set_finished_us(view.row.finished_us);
  message.set_tasks_total(view.row.tasks);
  message.set_tasks_done(view.tasks_done);
  message.set_tasks_known(view.row.known_tasks);
  message.set_run_us(view.row.run_us);
  for (const job::PhaseView& phase : view.phases) {
    v1::PhaseProgress& progress = *message.add_phases();
    progress.set_phase(phase.phase);
    progress.set_done(phase.done);
    progress.set_total(phase.total);
    progress.set_run_us(phase.run.count());
    progress.set_wall_us(phase.wall.count());
  }
  if (view.left_low.count() >= 0) {
    message.set_left_low_us(view.left_low.count());
    message.set_left_high_us(view.left_high.count());
  }
  for (const bakewell::TaskOutput& output : view.artifacts) {
    v1::Artifact& artifact = *message.add_artifacts();
    artifact.set_name(output.name);
    artifact.set_digest(DigestToBytes(output.digest));
    artifact.set_size_bytes(output.size_bytes);
  }
  for (const job::PreviewView& preview : view.previews) {
    v1::Preview& picture = *message.add_previews();
    picture.set_name(preview.name);
    picture.set_parts(preview.parts);
  }
  return message;
}

absl::StatusOr<job::JobView> BakeService::Find(const Caller& caller, int64_t id) {
  BAKEWELL_ASSIGN_OR_RETURN(job::JobView view, services_.coordinator.Get(id));
  if (!caller.MaySee(view.row.user)) return absl::NotFoundError(absl::StrCat("no job ", id));
  return view;
}

grpc::ServerUnaryReactor* BakeService::Submit(grpc::CallbackServerContext* context, const v1::SubmitRequest* request,
                                              v1::SubmitResponse* response) {
  return OnIo(services_, context, Any(Scope::kSubmit), [=, this](const Caller& caller) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const job::SubmitRequest submit, RequestOf(caller, *request));
    BAKEWELL_ASSIGN_OR_RETURN(const job::SubmitResult result, services_.coordinator.Submit(submit));
    response->set_job_id(result.job_id);
    response->set_existed(result.existed);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* BakeService::Estimate(grpc::CallbackServerContext* context, const v1::SubmitRequest* request,
                                                v1::EstimateResponse* response) {
  return OnIo(services_, context, Any(Scope::kSubmit), [=, this](const Caller& caller) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const job::SubmitRequest submit, RequestOf(caller, *request));
    BAKEWELL_ASSIGN_OR_RETURN(const job::Estimate estimate, services_.coordinator.EstimateCost(submit));
    response->set_tasks(estimate.tasks);
    response->set_tasks_known(estimate.tasks_known);
    response->set_run_us_low(estimate.run_low.count());
    response->set_run_us_high(estimate.run_high.count());
    response->set_memory_bytes(estimate.memory_bytes);
    response->set_complete(estimate.complete);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* BakeService::Get(grpc::CallbackServerContext* context, const v1::GetRequest* request,
                                           v1::Job* response) {
  return OnIo(services_, context, Any(Scope::kRead), [=, this](const Caller& caller) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const job::JobView view, Find(caller, request->job_id()));
    *response = MessageOf(view);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* BakeService::List(grpc::CallbackServerContext* context, const v1::ListRequest* request,
                                            v1::ListResponse* response) {
  return OnIo(services_, context, Any(Scope::kRead), [=, this](const Caller& caller) -> absl::Status {
    BAKEWELL_ASSIGN_OR_RETURN(const store::JobFilter filter, FilterOf(caller, *request));
    BAKEWELL_ASSIGN_OR_RETURN(std::vector<job::JobView> views, services_.coordinator.List(filter));
    for (job::JobView& view : views) {
      view.phases.clear();
      view.artifacts.clear();
      *response->add_jobs() = MessageOf(view);
    }
    if (static_cast<int>(views.size()) == filter.limit) {
      response->set_next_page_token(absl::StrCat(views.back().row.id));
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* BakeService::Cancel(grpc::CallbackServerContext* context, const v1::CancelRequest* request,
                                              v1::Job* response) {
  return OnIo(services_, context, Any(Scope::kSubmit), [=, this](const Caller& caller) -> absl::Status {
    BAKEWELL_RETURN_IF_ERROR(Find(caller, request->job_id()).status());
    BAKEWELL_RETURN_IF_ERROR(services_.coordinator.Cancel(request->job_id()));
    BAKEWELL_ASSIGN_OR_RETURN(const job::JobView view, Find(caller, request->job_id()));
    *response = MessageOf(view);
    return absl::OkStatus();
  });
}

absl::StatusOr<BlobRange> BakeService::PreviewRange(const v1::FetchRequest& request) {
  BAKEWELL_ASSIGN_OR_RETURN(std::string png, pictures_.Png(request.job_id(), request.name()));
  if (png.size() > kChunkBytes) return absl::ResourceExhaustedError("the picture is too large");
  return BlobRange{{}, request.offset(), std::move(png)};
}

grpc::ServerWriteReactor<v1::FetchChunk>* BakeService::Fetch(grpc::CallbackServerContext* context,
                                                             const v1::FetchRequest* request) {
  using Refused = RefusedStream<v1::FetchChunk>;
  const auto caller = services_.auth.Check(*context, Any(Scope::kRead));
  if (!caller.ok()) return new Refused(services_, *context, caller.status());
  auto slot = std::make_shared<BlobService::Slot>(transfers_, services_.max_transfers);
  if (!slot->granted())
    return new Refused(services_, *context, absl::ResourceExhaustedError("too many transfers at a time: try again"));
  const auto choose = [this, request, who = *caller]() -> absl::StatusOr<BlobRange> {
    BAKEWELL_ASSIGN_OR_RETURN(const job::JobView view, Find(who, request->job_id()));
    for (const job::PreviewView& preview : view.previews) {
      if (preview.name == request->name()) return PreviewRange(*request);
    }
    BAKEWELL_ASSIGN_OR_RETURN(const bakewell::TaskOutput artifact,
                              services_.coordinator.FindArtifact(request->job_id(), request->name()));
    return BlobRange{artifact.digest, request->offset(), {}};
  };
  return new BlobStream<v1::FetchChunk>(services_, *context, choose, [slot]() mutable { slot.reset(); });
}

grpc::ServerWriteReactor<v1::Job>* BakeService::Watch(grpc::CallbackServerContext* context,
                                                      const v1::WatchRequest* request) {
  using Refused = RefusedStream<v1::Job>;
  const auto caller = services_.auth.Check(*context, Any(Scope::kRead));
  if (!caller.ok()) return new Refused(services_, *context, caller.status());
  auto slot = std::make_shared<BlobService::Slot>(watches_, kMaxWatches);
  if (!slot->granted())
    return new Refused(services_, *context, absl::ResourceExhaustedError("too many watches: poll with Get"));
  const auto look = [this, who = *caller, id = request->job_id()] { return Find(who, id); };
  return WatchStream::Start(services_.coordinator, request->job_id(), look, [slot]() mutable { slot.reset(); });
}

}  // namespace bakewell::rpc
