#include "proto/rpc/channel.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace bakewell {

namespace {

absl::StatusOr<std::string> ReadText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::InvalidArgumentError(absl::StrCat("cannot read ", path.string()));
  return std::string(std::istreambuf_iterator<char>(file), {});
}

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> Credentials(const ConnectOptions& options) {
  if (options.ca_file.empty()) {
    if (!options.token.empty() && !IsLoopback(options.address)) {
      return absl::InvalidArgumentError(absl::StrCat("refusing to send a token in plain text to ", options.address,
                                                     ": give the certificate authority's file"));
    }
    return grpc::InsecureChannelCredentials();
  }
  grpc::SslCredentialsOptions ssl;
  BAKEWELL_ASSIGN_OR_RETURN(ssl.pem_root_certs, ReadText(options.ca_file));
  if (!options.cert_file.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(ssl.pem_cert_chain, ReadText(options.cert_file));
    BAKEWELL_ASSIGN_OR_RETURN(ssl.pem_private_key, ReadText(options.key_file));
  }
  return grpc::SslCredentials(ssl);
}

}  // namespace

void SilenceLibraries() {
  google::protobuf::SetLogHandler(nullptr);
  if (std::getenv("GRPC_VERBOSITY") != nullptr) return;
  constexpr int kAboveAll = GPR_LOG_SEVERITY_ERROR + 1;
  gpr_set_log_verbosity(static_cast<gpr_log_severity>(kAboveAll));
}

bool IsLoopback(const std::string& address) {
  return absl::StartsWith(address, "localhost:") || absl::StartsWith(address, "127.") ||
         absl::StartsWith(address, "[::1]:") || absl::StartsWith(address, "unix:");
}

absl::StatusOr<std::shared_ptr<Connection>> Connection::Open(const ConnectOptions& options) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto credentials, Credentials(options));
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  // Nobody packs: a message is held against that limit packed, whatever it unpacks to.
  arguments.SetInt(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, 1 << GRPC_COMPRESS_NONE);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, 20000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  // How long one try to connect may take; the pause between two is the backoff.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  // Own sockets for every connection: several in one process do not share flow control or fate.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return std::make_shared<Connection>(grpc::CreateCustomChannel(options.address, credentials, arguments),
                                      options.token);
}

Connection::Connection(std::shared_ptr<grpc::Channel> channel, std::string token)
    : channel_(std::move(channel)), token_(std::move(token)) {}

void Connection::Prepare(grpc::ClientContext& context, std::chrono::milliseconds timeout) const {
  PrepareStream(context);
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  // A connection is made only while a call waits for it (gRPC's own poll comes every five seconds).
  context.set_wait_for_ready(true);
}

void Connection::PrepareStream(grpc::ClientContext& context) const {
  if (!token_.empty()) context.AddMetadata("authorization", absl::StrCat("Bearer ", token_));
}

}  // namespace bakewell
