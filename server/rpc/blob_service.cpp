#include "server/rpc/blob_service.h"

#include <absl/strings/str_cat.h>

#include "server/rpc/blob_stream.h"

namespace bakewell::rpc {

namespace {

constexpr int kMaxDigests = 10'000;

absl::Status ListMissing(const store::BlobStore& blobs, const v1::FindMissingRequest& request,
                         v1::FindMissingResponse& response) {
  if (request.digests_size() > kMaxDigests) {
    return absl::InvalidArgumentError(absl::StrCat("more than ", kMaxDigests, " digests: ask in parts"));
  }
  for (const std::string& bytes : request.digests()) {
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(bytes));
    if (!blobs.Has(digest)) response.add_missing(bytes);
  }
  return absl::OkStatus();
}

// Receives one blob. Deletes itself.
class UploadStream final : public grpc::ServerReadReactor<v1::UploadRequest> {
 public:
  UploadStream(Services& services, grpc::CallbackServerContext& context, std::atomic<int>& transfers,
               const absl::Status& refused)
      : services_(services),
        peer_(context.peer()),
        slot_(transfers, services.max_transfers),
        stall_(services.stalls, context) {
    if (!refused.ok()) {
      End(refused);
    } else if (!slot_.granted()) {
      End(absl::ResourceExhaustedError("too many transfers at a time: try again"));
    } else {
      StartRead(&request_);
    }
  }
  void OnReadDone(bool ok) override {
    stall_.Touch();
    services_.coordinator.io().Post([this, ok] { ok ? Take() : Complete(); });
  }
  void OnDone() override { delete this; }

 private:
  void End(const absl::Status& status) {
    upload_.reset();
    Finish(services_.Answer(peer_, status));
  }

  absl::Status Begin() {
    BAKEWELL_ASSIGN_OR_RETURN(digest_, DigestFromBytes(request_.digest()));
    if (request_.size_bytes() > services_.max_blob_bytes) {
      return absl::ResourceExhaustedError(absl::StrCat("a blob may have at most ", services_.max_blob_bytes, " bytes"));
    }
    BAKEWELL_ASSIGN_OR_RETURN(upload_, services_.coordinator.blobs().StartUpload(digest_, request_.size_bytes()));
    return absl::OkStatus();
  }

  void Take() {
    absl::Status status;
    if (!upload_) {
      status = Begin();
      if (status.ok() && services_.coordinator.blobs().Has(digest_)) return Record();
    }
    if (status.ok()) status = upload_->Append(request_.data());
    if (status.ok())
      StartRead(&request_);
    else
      End(status);
  }

  void Complete() {
    if (!upload_) return End(absl::InvalidArgumentError("an upload begins with a digest and a size"));
    const absl::Status status = upload_->Finish();
    if (status.ok())
      Record();
    else
      End(status);
  }

  // Answers once the database knows of it, so that nobody collects it as a stray.
  void Record() {
    const int64_t size_bytes = services_.coordinator.blobs().SizeOf(digest_);
    services_.coordinator.RecordBlob(digest_, size_bytes, [this](const absl::Status& status) { End(status); });
  }

  Services& services_;
  const std::string peer_;
  const BlobService::Slot slot_;
  StallGuard::Entry stall_;
  v1::UploadRequest request_;
  Digest digest_;
  std::unique_ptr<store::BlobStore::Upload> upload_;
};

}  // namespace

grpc::ServerUnaryReactor* BlobService::FindMissing(grpc::CallbackServerContext* context,
                                                   const v1::FindMissingRequest* request,
                                                   v1::FindMissingResponse* response) {
  return AtOnce(services_, context, Any(Scope::kSubmit, Scope::kWork),
                [&](const Caller&) { return ListMissing(services_.coordinator.blobs(), *request, *response); });
}

grpc::ServerReadReactor<v1::UploadRequest>* BlobService::Upload(grpc::CallbackServerContext* context,
                                                                v1::UploadResponse*) {
  const auto caller = services_.auth.Check(*context, Any(Scope::kSubmit, Scope::kWork));
  return new UploadStream(services_, *context, transfers_, caller.status());
}

grpc::ServerWriteReactor<v1::DownloadChunk>* BlobService::Download(grpc::CallbackServerContext* context,
                                                                   const v1::DownloadRequest* request) {
  using Refused = RefusedStream<v1::DownloadChunk>;
  const auto caller = services_.auth.Check(*context, Any(Scope::kWork));
  if (!caller.ok()) return new Refused(services_, *context, caller.status());
  auto slot = std::make_shared<Slot>(transfers_, services_.max_transfers);
  if (!slot->granted())
    return new Refused(services_, *context, absl::ResourceExhaustedError("too many transfers at a time: try again"));
  const auto choose = [request]() -> absl::StatusOr<BlobRange> {
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(request->digest()));
    return BlobRange{digest, request->offset(), {}};
  };
  return new BlobStream<v1::DownloadChunk>(services_, *context, choose, [slot]() mutable { slot.reset(); });
}

}  // namespace bakewell::rpc
