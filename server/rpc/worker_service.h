#pragma once

#include "proto/bakewell/v1/worker.grpc.pb.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

// proto/bakewell/v1/worker.proto.
class WorkerService final : public v1::WorkerService::CallbackService {
 public:
  explicit WorkerService(Services& services) : services_(services) {}

  grpc::ServerUnaryReactor* Register(grpc::CallbackServerContext* context, const v1::RegisterRequest* request,
                                     v1::RegisterResponse* response) override;
  grpc::ServerBidiReactor<v1::LeaseRequest, v1::LeaseResponse>* Lease(grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* Heartbeat(grpc::CallbackServerContext* context, const v1::HeartbeatRequest* request,
                                      v1::HeartbeatResponse* response) override;
  grpc::ServerUnaryReactor* Complete(grpc::CallbackServerContext* context, const v1::CompleteRequest* request,
                                     v1::CompleteResponse* response) override;
  grpc::ServerUnaryReactor* Fail(grpc::CallbackServerContext* context, const v1::FailRequest* request,
                                 v1::FailResponse* response) override;
  grpc::ServerUnaryReactor* Release(grpc::CallbackServerContext* context, const v1::ReleaseRequest* request,
                                    v1::ReleaseResponse* response) override;

 private:
  Services& services_;
};

}  // namespace bakewell::rpc
