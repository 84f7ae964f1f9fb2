#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/status.h"

namespace bakewell {

// Where a coordinator is and how to show who one is. Without ca_file the channel is plain text, which is for loopback
// and private networks; a token is sent in plain text to loopback only.
struct ConnectOptions {
  std::string address = "localhost:7717";
  std::filesystem::path ca_file;    // certificates to trust: turns TLS on
  std::filesystem::path cert_file;  // one's own, for mutual TLS; with key_file
  std::filesystem::path key_file;
  std::string token;
};

// One connection, shared by all calls. Thread safe.
class Connection {
 public:
  // kInvalidArgument: a file that cannot be read, or a token that would travel in plain text. Does not connect yet.
  static absl::StatusOr<std::shared_ptr<Connection>> Open(const ConnectOptions& options);
  // On a channel that exists, for example grpc::Server::InProcessChannel.
  Connection(std::shared_ptr<grpc::Channel> channel, std::string token);

  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // Gives a call its token and deadline; until then it waits for a coordinator that is not there.
  void Prepare(grpc::ClientContext& context, std::chrono::milliseconds timeout) const;
  // Gives a call its token and no deadline, for streams that last; without a connection it fails at once.
  void PrepareStream(grpc::ClientContext& context) const;

 private:
  const std::shared_ptr<grpc::Channel> channel_;
  const std::string token_;
};

// The largest message either side takes, and the size of a chunk of a blob.
inline constexpr int kMaxMessageBytes = 4 << 20;
inline constexpr size_t kChunkBytes = 512 << 10;

// Keeps protobuf and gRPC (unless GRPC_VERBOSITY is set) from printing what they refuse, for the whole process: hostile
// bytes would fill the log.
void SilenceLibraries();

// Whether host:port names this machine only.
bool IsLoopback(const std::string& address);

}  // namespace bakewell
