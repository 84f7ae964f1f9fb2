#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <mutex>
#include <utility>

#include "core/base/caught.h"
#include "proto/rpc/status.h"
#include "server/rpc/auth.h"
#include "server/rpc/refusal_log.h"
#include "server/rpc/stall_guard.h"

namespace bakewell::rpc {

// What the services share: whom they serve, who may call, and the limits.
struct Services {
  job::Coordinator& coordinator;
  Auth& auth;
  RefusalLog& refusals;
  StallGuard& stalls;
  int64_t max_blob_bytes = int64_t{4} << 30;
  int max_transfers = 256;  // uploads and downloads at a time

  // The status as gRPC has it; a refusal is logged.
  grpc::Status Answer(const std::string& peer, const absl::Status& status) const {
    if (!status.ok()) refusals.Note(peer, status, coordinator.WallNowUs());
    return ToGrpc(status);
  }
};

// A unary call that may wait for a disk: `work(caller)` runs on the coordinator's io threads and gives the status.
template <typename Work>
grpc::ServerUnaryReactor* OnIo(Services& services, grpc::CallbackServerContext* context, int scopes, Work work) {
  auto* reactor = context->DefaultReactor();
  const auto caller = services.auth.Check(*context, scopes);
  if (!caller.ok()) {
    reactor->Finish(services.Answer(context->peer(), caller.status()));
    return reactor;
  }
  services.coordinator.io().Post([reactor, context, &services, work = std::move(work), caller = *caller]() mutable {
    reactor->Finish(services.Answer(context->peer(), Caught([&]() -> absl::Status { return work(caller); })));
  });
  return reactor;
}

// A unary call that only touches memory: `work(caller)` runs at once.
template <typename Work>
grpc::ServerUnaryReactor* AtOnce(Services& services, grpc::CallbackServerContext* context, int scopes, Work work) {
  auto* reactor = context->DefaultReactor();
  const auto caller = services.auth.Check(*context, scopes);
  reactor->Finish(services.Answer(context->peer(), caller.ok() ? work(*caller) : caller.status()));
  return reactor;
}

inline int Any(Scope a) { return static_cast<int>(a); }
inline int Any(Scope a, Scope b) { return static_cast<int>(a) | static_cast<int>(b); }

}  // namespace bakewell::rpc
