#include "server/rpc/farm_server.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <fstream>
#include <iterator>

#include "proto/rpc/channel.h"
#include "server/rpc/admin_service.h"
#include "server/rpc/auth.h"
#include "server/rpc/bake_service.h"
#include "server/rpc/blob_service.h"
#include "server/rpc/worker_service.h"

namespace bakewell::rpc {

namespace {

absl::StatusOr<std::string> ReadText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::InvalidArgumentError(absl::StrCat("cannot read ", path.string()));
  return std::string(std::istreambuf_iterator<char>(file), {});
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> Credentials(const ServerOptions& options) {
  if (options.cert_file.empty()) return grpc::InsecureServerCredentials();
  grpc::SslServerCredentialsOptions ssl;
  grpc::SslServerCredentialsOptions::PemKeyCertPair pair;
  BAKEWELL_ASSIGN_OR_RETURN(pair.private_key, ReadText(options.key_file));
  BAKEWELL_ASSIGN_OR_RETURN(pair.cert_chain, ReadText(options.cert_file));
  ssl.pem_key_cert_pairs.push_back(pair);
  if (!options.client_ca_file.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(ssl.pem_root_certs, ReadText(options.client_ca_file));
    ssl.client_certificate_request = GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  }
  return grpc::SslServerCredentials(ssl);
}

absl::Status CheckExposure(job::Coordinator& coordinator, const ServerOptions& options) {
  if (options.listen.empty() || IsLoopback(options.listen)) return absl::OkStatus();
  if (options.cert_file.empty() && !options.allow_plain_text) {
    return absl::FailedPreconditionError(absl::StrCat("refusing to serve ", options.listen,
                                                      " in plain text: give a certificate and key, or listen on "
                                                      "127.0.0.1"));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const int64_t tokens, coordinator.CountTokens());
  if (tokens > 0) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("refusing to serve ", options.listen,
                                                    " to anybody: make a token first (bakewell-server token add)"));
}

void SetLimits(const ServerOptions& options, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("bakewell-server");
  quota.Resize(static_cast<size_t>(options.memory_bytes));
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  // gRPC holds a message against the limit before it unpacks it: 4 MiB can become 4 GiB. Nobody here packs.
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    builder.SetCompressionAlgorithmSupportStatus(algorithm, false);
  }
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, 256);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, 16 << 10);
  // Half-open connections are found; a client may ping every five seconds, not more often.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
}

}  // namespace

struct FarmServer::Parts {
  explicit Parts(job::Coordinator& coordinator, const ServerOptions& options)
      : auth(coordinator),
        refusals(coordinator.options().log),
        stalls(options.stall_limit),
        services{coordinator, auth, refusals, stalls, options.max_blob_bytes} {}
  Auth auth;
  RefusalLog refusals;
  StallGuard stalls;
  Services services;
  BlobService blob{services};
  BakeService bake{services};
  WorkerService worker{services};
  AdminService admin{services};
  std::unique_ptr<grpc::Server> server;
};

FarmServer::FarmServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

absl::StatusOr<std::unique_ptr<FarmServer>> FarmServer::Start(job::Coordinator& coordinator,
                                                              const ServerOptions& options) {
  SilenceLibraries();
  BAKEWELL_RETURN_IF_ERROR(CheckExposure(coordinator, options));
  BAKEWELL_ASSIGN_OR_RETURN(const auto credentials, Credentials(options));
  auto parts = std::make_unique<Parts>(coordinator, options);
  grpc::ServerBuilder builder;
  int port = 0;
  if (!options.listen.empty()) builder.AddListeningPort(options.listen, credentials, &port);
  SetLimits(options, builder);
  for (grpc::Service* service :
       {static_cast<grpc::Service*>(&parts->blob), static_cast<grpc::Service*>(&parts->bake),
        static_cast<grpc::Service*>(&parts->worker), static_cast<grpc::Service*>(&parts->admin)}) {
    builder.RegisterService(service);
  }
  parts->server = builder.BuildAndStart();
  if (!parts->server || (!options.listen.empty() && port == 0)) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", options.listen, ": is another server running?"));
  }
  std::unique_ptr<FarmServer> server(new FarmServer(std::move(parts)));
  server->port_ = port;
  return server;
}

FarmServer::~FarmServer() {
  parts_->server->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
  parts_->server->Wait();
}

std::shared_ptr<grpc::Channel> FarmServer::InProcessChannel() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return parts_->server->InProcessChannel(arguments);
}

uint64_t FarmServer::refused() const { return parts_->auth.refused(); }

}  // namespace bakewell::rpc
