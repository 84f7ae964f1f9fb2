#include "proto/rpc/transfer.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <thread>

#include "core/base/fields.h"
#include "proto/bakewell/v1/blob.grpc.pb.h"
#include "proto/rpc/status.h"

namespace bakewell {

namespace {

constexpr auto kShortCall = std::chrono::seconds(30);
// A slow network is 1 MiB/s; a blob gets the time that this takes, and a minute.
std::chrono::milliseconds TransferTime(int64_t size_bytes) { return std::chrono::seconds(60 + (size_bytes >> 20)); }

absl::Status AppendChunks(const Connection& connection, const Digest& digest, int64_t max_bytes, std::string& bytes) {
  const auto stub = v1::BlobService::NewStub(connection.channel());
  grpc::ClientContext context;
  connection.Prepare(context, TransferTime(max_bytes));
  v1::DownloadRequest request;
  request.set_digest(DigestToBytes(digest));
  request.set_offset(static_cast<int64_t>(bytes.size()));
  const auto reader = stub->Download(&context, request);
  v1::DownloadChunk chunk;
  bool too_large = false;
  while (!too_large && reader->Read(&chunk)) {
    if (chunk.size_bytes() > 0 && chunk.size_bytes() <= max_bytes) bytes.reserve(chunk.size_bytes());
    too_large = static_cast<int64_t>(bytes.size() + chunk.data().size()) > max_bytes;
    if (!too_large) bytes += chunk.data();
  }
  if (too_large) context.TryCancel();
  const absl::Status status = FromGrpc(reader->Finish());
  if (!too_large) return status;
  return absl::ResourceExhaustedError(absl::StrCat("blob ", digest.Hex(), " is above ", max_bytes, " bytes"));
}

}  // namespace

absl::StatusOr<std::vector<Digest>> FindMissing(const Connection& connection, const std::vector<Digest>& digests) {
  const auto stub = v1::BlobService::NewStub(connection.channel());
  v1::FindMissingRequest request;
  for (const Digest& digest : digests) request.add_digests(DigestToBytes(digest));
  v1::FindMissingResponse response;
  grpc::ClientContext context;
  connection.Prepare(context, kShortCall);
  BAKEWELL_RETURN_IF_ERROR(FromGrpc(stub->FindMissing(&context, request, &response)));
  std::vector<Digest> missing;
  for (const std::string& bytes : response.missing()) {
    BAKEWELL_ASSIGN_OR_RETURN(const Digest digest, DigestFromBytes(bytes));
    missing.push_back(digest);
  }
  return missing;
}

absl::Status UploadBlob(const Connection& connection, const Digest& digest, std::string_view bytes) {
  const auto stub = v1::BlobService::NewStub(connection.channel());
  grpc::ClientContext context;
  connection.Prepare(context, TransferTime(static_cast<int64_t>(bytes.size())));
  v1::UploadResponse response;
  const auto writer = stub->Upload(&context, &response);
  v1::UploadRequest request;
  request.set_digest(DigestToBytes(digest));
  request.set_size_bytes(static_cast<int64_t>(bytes.size()));
  // A refused write means that the server has answered already: with what, Finish says.
  do {
    const std::string_view chunk = bytes.substr(0, kChunkBytes);
    request.set_data(chunk.data(), chunk.size());
    bytes.remove_prefix(chunk.size());
    if (!writer->Write(request)) break;
    request.Clear();
  } while (!bytes.empty());
  writer->WritesDone();
  return FromGrpc(writer->Finish());
}

absl::StatusOr<std::string> DownloadBlob(const Connection& connection, const Digest& digest, int64_t max_bytes,
                                         int tries) {
  std::string bytes;
  for (int tried = 1;; ++tried) {
    const absl::Status status = AppendChunks(connection, digest, max_bytes, bytes);
    if (status.ok()) break;
    const bool again = absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status);
    if (!again || tried >= tries) return status;
    std::this_thread::sleep_for(std::chrono::milliseconds(100) * std::min(tried, 10));
  }
  if (Sha256Of(bytes) == digest) return bytes;
  return absl::DataLossError(absl::StrCat("blob ", digest.Hex(), ": other bytes came; fetch it again"));
}

}  // namespace bakewell
