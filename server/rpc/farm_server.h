#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/status.h"
#include "server/job/coordinator.h"

namespace grpc {
class Channel;
}

namespace bakewell::rpc {

struct ServerOptions {
  std::string listen;               // "127.0.0.1:7717", port 0: any; empty: only InProcessChannel()
  std::filesystem::path cert_file;  // with key_file: TLS
  std::filesystem::path key_file;
  std::filesystem::path client_ca_file;  // clients must show a certificate that this signed
  bool allow_plain_text = false;         // beyond loopback without TLS: for networks that encrypt by themselves
  int64_t max_blob_bytes = int64_t{4} << 30;
  std::chrono::milliseconds stall_limit = std::chrono::seconds(30);  // a transfer in which nothing moves ends
  int64_t memory_bytes = int64_t{1} << 30;                           // of gRPC's buffers; above it calls are refused
};

// The services of proto/bakewell/v1 on a port. Ends its calls before it goes; the coordinator must outlive it.
class FarmServer {
 public:
  // kFailedPrecondition: an address beyond loopback without TLS, or without any token in the database.
  // kUnavailable: the port cannot be had.
  static absl::StatusOr<std::unique_ptr<FarmServer>> Start(job::Coordinator& coordinator, const ServerOptions& options);
  ~FarmServer();
  int port() const { return port_; }
  std::shared_ptr<grpc::Channel> InProcessChannel();
  // Calls that were refused for want of a token or a scope.
  uint64_t refused() const;

 private:
  struct Parts;
  explicit FarmServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
  int port_ = 0;
};

}  // namespace bakewell::rpc
