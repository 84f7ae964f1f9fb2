#include "server/rpc/lease_stream.h"

#include <utility>

namespace bakewell::rpc {

void FillLease(const job::TaskLease& lease, v1::TaskLease& message) {
  message.set_token(static_cast<uint64_t>(lease.token));
  message.set_key(DigestToBytes(lease.key.digest));
  message.set_spec(lease.spec);
  message.set_run_limit_us(lease.run_limit.count());
  message.set_memory_bytes(lease.memory_bytes);
}

LeaseStream::LeaseStream(Services& services, const std::string& peer, const absl::Status& refused)
    : services_(services), peer_(peer) {
  if (refused.ok())
    StartRead(&request_);
  else
    End(refused);
}

absl::Status LeaseStream::Take() {
  job::Coordinator& coordinator = services_.coordinator;
  if (connection_ == 0) {
    worker_ = sched::WorkerId{request_.worker_id()};
    connection_ = coordinator.Connect(worker_, [this](job::LeaseNews news) { Push(std::move(news)); });
  }
  const bool known = connection_ != 0 && coordinator.AddCredit(worker_, request_.add_credit());
  return known ? absl::OkStatus() : absl::FailedPreconditionError("this worker is not known: register again");
}

void LeaseStream::OnReadDone(bool ok) {
  if (!ok) return End(absl::OkStatus());
  const absl::Status status = Take();
  if (!status.ok()) return End(status);
  StartRead(&request_);
}

void LeaseStream::Push(job::LeaseNews news) {
  const std::lock_guard lock(mutex_);
  for (const job::TaskLease& lease : news.leases) FillLease(lease, *waiting_.add_leases());
  for (const sched::LeaseToken token : news.revoked) waiting_.add_revoked(static_cast<uint64_t>(token));
  if (news.drain) waiting_.set_drain(true);
  if (news.superseded) waiting_.set_superseded(true);
  if (!writing_ && !ending_) WriteLocked();
}

void LeaseStream::WriteLocked() {
  writing_ = true;
  sending_ = std::exchange(waiting_, {});
  StartWrite(&sending_);
}

void LeaseStream::OnWriteDone(bool ok) {
  {
    const std::lock_guard lock(mutex_);
    writing_ = false;
    const bool more =
        waiting_.leases_size() > 0 || waiting_.revoked_size() > 0 || waiting_.drain() || waiting_.superseded();
    if (ok && !ending_) {
      if (more) WriteLocked();
      return;
    }
  }
  End(absl::CancelledError("the worker went away"));
}

void LeaseStream::OnCancel() { End(absl::CancelledError("cancelled")); }

void LeaseStream::End(const absl::Status& status) {
  const std::lock_guard lock(mutex_);
  if (!ending_) end_ = status;
  ending_ = true;
  if (writing_ || finished_) return;  // Finish comes after the write
  finished_ = true;
  Finish(services_.Answer(peer_, end_));
}

void LeaseStream::OnDone() {
  if (connection_ != 0) services_.coordinator.Disconnect(worker_, connection_);
  delete this;
}

}  // namespace bakewell::rpc
