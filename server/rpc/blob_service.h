#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "proto/bakewell/v1/blob.grpc.pb.h"
#include "server/rpc/call.h"

namespace bakewell::rpc {

// proto/bakewell/v1/blob.proto. Disk work runs on the coordinator's io threads; each stream holds one chunk.
class BlobService final : public v1::BlobService::CallbackService {
 public:
  explicit BlobService(Services& services) : services_(services) {}

  grpc::ServerUnaryReactor* FindMissing(grpc::CallbackServerContext* context, const v1::FindMissingRequest* request,
                                        v1::FindMissingResponse* response) override;
  grpc::ServerReadReactor<v1::UploadRequest>* Upload(grpc::CallbackServerContext* context,
                                                     v1::UploadResponse* response) override;
  grpc::ServerWriteReactor<v1::DownloadChunk>* Download(grpc::CallbackServerContext* context,
                                                        const v1::DownloadRequest* request) override;

  // Counts transfers, for the limit.
  class Slot {
   public:
    explicit Slot(std::atomic<int>& count, int limit) : count_(count), granted_(count.fetch_add(1) < limit) {}
    ~Slot() { count_.fetch_sub(1); }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    bool granted() const { return granted_; }

   private:
    std::atomic<int>& count_;
    const bool granted_;
  };

 private:
  Services& services_;
  std::atomic<int> transfers_{0};
};

}  // namespace bakewell::rpc
