#pragma once

#include <CLI/CLI.hpp>

#include <memory>
#include <string>

#include "client/rpc/farm_client.h"

namespace bakewell {

// How to reach a coordinator, for every command that does.
struct ConnectFlags {
  ConnectOptions connect;
  std::string token_file;
};
void AddConnectFlags(CLI::App& command, ConnectFlags& flags);

// kInvalidArgument: a file of the flags cannot be read, or a token would travel in plain text. Does not connect yet.
absl::StatusOr<std::unique_ptr<FarmClient>> OpenClient(const ConnectFlags& flags);

}  // namespace bakewell
