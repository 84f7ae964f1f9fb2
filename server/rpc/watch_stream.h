#pragma once

#include <functional>
#include <memory>
#include <mutex>

#include "proto/bakewell/v1/bake.pb.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

// Sends a job now and whenever it changed, until it has ended. A reader that is slow gets fewer messages, never old
// ones. Owns itself until the call is over.
class WatchStream final : public grpc::ServerWriteReactor<v1::Job>, public std::enable_shared_from_this<WatchStream> {
 public:
  using Look = std::function<absl::StatusOr<job::JobView>()>;
  static WatchStream* Start(job::Coordinator& coordinator, int64_t job, Look look, std::function<void()> ended);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  WatchStream(job::Coordinator& coordinator, Look look, std::function<void()> ended)
      : coordinator_(coordinator), look_(std::move(look)), ended_(std::move(ended)) {}
  void Changed();
  void Send();
  void FinishLocked(const absl::Status& status);

  job::Coordinator& coordinator_;
  const Look look_;
  const std::function<void()> ended_;
  job::WatchList::Id watch_ = 0;
  std::shared_ptr<WatchStream> self_;

  std::mutex mutex_;  // guards what follows
  v1::Job message_;
  bool writing_ = false, changed_ = false, last_ = false, finished_ = false;
};

}  // namespace bakewell::rpc
