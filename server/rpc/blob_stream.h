#pragma once

#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/base/caught.h"
#include "proto/rpc/channel.h"
#include "proto/rpc/status.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

// Which blob, from where, or why not; asked on an io thread.
struct BlobRange {
  Digest digest;
  int64_t offset = 0;
  std::optional<std::string> made;  // at most kChunkBytes: sent instead of a blob of the store
};
using BlobChooser = std::function<absl::StatusOr<BlobRange>()>;

// Streams a blob from the store as messages with `data` and, first, `size_bytes`. Holds one chunk. Deletes itself.
template <typename Chunk>
class BlobStream final : public grpc::ServerWriteReactor<Chunk> {
 public:
  BlobStream(Services& services, grpc::CallbackServerContext& context, BlobChooser choose, std::function<void()> ended)
      : services_(services),
        coordinator_(services.coordinator),
        peer_(context.peer()),
        choose_(std::move(choose)),
        ended_(std::move(ended)),
        stall_(services.stalls, context) {
    coordinator_.io().Post([this] { Start(); });
  }
  void OnWriteDone(bool ok) override {
    stall_.Touch();
    if (ok)
      coordinator_.io().Post([this] { Next(); });
    else
      this->Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the reader went away"));
  }
  void OnDone() override {
    ended_();
    delete this;
  }

 private:
  void Start() {
    const absl::StatusOr<BlobRange> range = Caught(choose_);
    const absl::Status status = range.ok() ? Open(*range) : range.status();
    if (!status.ok())
      this->Finish(services_.Answer(peer_, status));
    else if (range->made)
      this->StartWriteAndFinish(&chunk_, grpc::WriteOptions(), grpc::Status());
    else
      Next();
  }

  absl::Status Open(const BlobRange& range) {
    if (range.made) {
      const auto size = std::ssize(*range.made);
      if (range.offset < 0 || range.offset > size) return absl::OutOfRangeError("offset is beyond the picture");
      chunk_.set_size_bytes(size);
      chunk_.set_data(range.made->substr(static_cast<size_t>(range.offset)));
      return absl::OkStatus();
    }
    BAKEWELL_ASSIGN_OR_RETURN(download_, coordinator_.blobs().StartDownload(range.digest));
    BAKEWELL_RETURN_IF_ERROR(download_->Skip(range.offset));
    left_ = download_->size_bytes() - range.offset;
    chunk_.set_size_bytes(download_->size_bytes());
    return absl::OkStatus();
  }

  void Next() {
    const size_t want = static_cast<size_t>(std::min<int64_t>(kChunkBytes, left_));
    auto bytes = left_ == 0 && sent_ ? absl::StatusOr<std::string>(std::string()) : download_->Next(want);
    if (!bytes.ok()) {
      this->Finish(ToGrpc(bytes.status()));
    } else if (bytes->empty() && sent_) {
      this->Finish(ToGrpc(download_->Verify()));
    } else {
      left_ -= static_cast<int64_t>(bytes->size());
      if (sent_) chunk_.clear_size_bytes();
      sent_ = true;
      chunk_.set_data(*std::move(bytes));
      this->StartWrite(&chunk_);
    }
  }

  const Services& services_;
  job::Coordinator& coordinator_;
  const std::string peer_;
  BlobChooser choose_;
  std::function<void()> ended_;
  StallGuard::Entry stall_;
  std::unique_ptr<store::BlobStore::Download> download_;
  int64_t left_ = 0;
  bool sent_ = false;
  Chunk chunk_;
};

// A stream that says only why it does not start.
template <typename Chunk>
class RefusedStream final : public grpc::ServerWriteReactor<Chunk> {
 public:
  RefusedStream(const Services& services, const grpc::CallbackServerContext& context, const absl::Status& status) {
    this->Finish(services.Answer(context.peer(), status));
  }
  void OnDone() override { delete this; }
};

}  // namespace bakewell::rpc
