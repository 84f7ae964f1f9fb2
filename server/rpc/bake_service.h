#pragma once

#include <atomic>

#include "proto/bakewell/v1/bake.grpc.pb.h"
#include "server/preview/pictures.h"
#include "server/rpc/blob_stream.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

// A job as the message says it.
v1::Job MessageOf(const job::JobView& view);

// proto/bakewell/v1/bake.proto.
class BakeService final : public v1::BakeService::CallbackService {
 public:
  explicit BakeService(Services& services) : services_(services) {}

  grpc::ServerUnaryReactor* Submit(grpc::CallbackServerContext* context, const v1::SubmitRequest* request,
                                   v1::SubmitResponse* response) override;
  grpc::ServerUnaryReactor* Get(grpc::CallbackServerContext* context, const v1::GetRequest* request,
                                v1::Job* response) override;
  grpc::ServerUnaryReactor* List(grpc::CallbackServerContext* context, const v1::ListRequest* request,
                                 v1::ListResponse* response) override;
  grpc::ServerWriteReactor<v1::Job>* Watch(grpc::CallbackServerContext* context,
                                           const v1::WatchRequest* request) override;
  grpc::ServerUnaryReactor* Cancel(grpc::CallbackServerContext* context, const v1::CancelRequest* request,
                                   v1::Job* response) override;
  grpc::ServerWriteReactor<v1::FetchChunk>* Fetch(grpc::CallbackServerContext* context,
                                                  const v1::FetchRequest* request) override;
  grpc::ServerUnaryReactor* Estimate(grpc::CallbackServerContext* context, const v1::SubmitRequest* request,
                                     v1::EstimateResponse* response) override;

 private:
  // The job, if the caller may see it; kNotFound otherwise, so that ids of others tell nothing.
  absl::StatusOr<job::JobView> Find(const Caller& caller, int64_t id);

  absl::StatusOr<BlobRange> PreviewRange(const v1::FetchRequest& request);

  Services& services_;
  preview::Pictures pictures_{services_.coordinator};
  std::atomic<int> transfers_{0};
  std::atomic<int> watches_{0};
};

}  // namespace bakewell::rpc
