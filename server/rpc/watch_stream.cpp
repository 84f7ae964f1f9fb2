#include "server/rpc/watch_stream.h"

#include "server/rpc/bake_service.h"

namespace bakewell::rpc {

WatchStream* WatchStream::Start(job::Coordinator& coordinator, int64_t job, Look look, std::function<void()> ended) {
  std::shared_ptr<WatchStream> stream(new WatchStream(coordinator, std::move(look), std::move(ended)));
  stream->self_ = stream;
  stream->watch_ = coordinator.watches().Add(job, [weak = std::weak_ptr(stream)] {
    if (const auto strong = weak.lock()) strong->Changed();
  });
  stream->Changed();
  return stream.get();
}

void WatchStream::Changed() {
  coordinator_.io().Post([self = shared_from_this()] { self->Send(); });
}

void WatchStream::Send() {
  {
    const std::lock_guard lock(mutex_);
    changed_ = true;
    if (writing_ || finished_ || last_) return;
    writing_ = true;
    changed_ = false;
  }
  const auto view = look_();
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  if (!view.ok()) {
    writing_ = false;
    return FinishLocked(view.status());
  }
  message_ = MessageOf(*view);
  last_ = view->row.state != store::JobState::kRunning;
  StartWrite(&message_);
}

void WatchStream::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  writing_ = false;
  if (!ok) return FinishLocked(absl::CancelledError("the watcher went away"));
  if (last_) return FinishLocked(absl::OkStatus());
  if (changed_) Changed();
}

void WatchStream::OnCancel() {
  const std::lock_guard lock(mutex_);
  if (!writing_) FinishLocked(absl::CancelledError("cancelled"));
}

void WatchStream::FinishLocked(const absl::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(ToGrpc(status));
}

void WatchStream::OnDone() {
  coordinator_.watches().Remove(watch_);
  ended_();
  const std::shared_ptr<WatchStream> last = std::move(self_);
}

}  // namespace bakewell::rpc
