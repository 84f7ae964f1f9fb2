#include "client/cli/farm_flags.h"

#include <cstdlib>
#include <fstream>

namespace bakewell {

void AddConnectFlags(CLI::App& command, ConnectFlags& flags) {
  command.add_option("--server", flags.connect.address, "the coordinator's HOST:PORT")->capture_default_str();
  command.add_option("--ca", flags.connect.ca_file, "certificate authority (PEM): turns TLS on");
  command.add_option("--cert", flags.connect.cert_file, "own certificate, for mutual TLS");
  command.add_option("--key", flags.connect.key_file, "its private key");
  command.add_option("--token-file", flags.token_file, "file with the token; else the environment's BAKEWELL_TOKEN");
}

absl::StatusOr<std::unique_ptr<FarmClient>> OpenClient(const ConnectFlags& flags) {
  ConnectOptions connect = flags.connect;
  if (!flags.token_file.empty()) {
    std::ifstream file(flags.token_file);
    if (!(file >> connect.token)) return absl::InvalidArgumentError("cannot read a token in " + flags.token_file);
  } else if (const char* token = std::getenv("BAKEWELL_TOKEN")) {
    connect.token = token;
  }
  BAKEWELL_ASSIGN_OR_RETURN(auto connection, Connection::Open(connect));
  return std::make_unique<FarmClient>(std::move(connection));
}

}  // namespace bakewell
