#pragma once

#include <memory>
#include <mutex>

#include "proto/bakewell/v1/worker.pb.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

void FillLease(const job::TaskLease& lease, v1::TaskLease& message);

// A worker's Lease stream: credit comes in, leases and news go out. What waits to be sent is bounded by the credit and
// by the leases that can be revoked. Deletes itself.
class LeaseStream final : public grpc::ServerBidiReactor<v1::LeaseRequest, v1::LeaseResponse> {
 public:
  LeaseStream(Services& services, const std::string& peer, const absl::Status& refused);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  absl::Status Take();
  void Push(job::LeaseNews news);
  void WriteLocked();
  void End(const absl::Status& status);

  Services& services_;
  const std::string peer_;
  v1::LeaseRequest request_;
  sched::WorkerId worker_{};
  uint64_t connection_ = 0;

  std::mutex mutex_;  // guards what follows; taken after the coordinator's, never around a call of it
  v1::LeaseResponse waiting_, sending_;
  bool writing_ = false, ending_ = false, finished_ = false;
  absl::Status end_;
};

}  // namespace bakewell::rpc
