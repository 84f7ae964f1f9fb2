#pragma once

#include <absl/container/flat_hash_map.h>
#include <grpcpp/server_context.h>

#include <mutex>
#include <string>

#include "core/base/status.h"
#include "server/job/coordinator.h"

namespace bakewell::rpc {

enum class Scope : int { kSubmit = 1, kWork = 2, kRead = 4, kAdmin = 8 };

struct Caller {
  std::string user;
  int scopes = 0;
  bool Has(Scope scope) const { return (scopes & static_cast<int>(scope)) != 0; }
  // Whether the caller may see and change what belongs to `owner`.
  bool MaySee(const std::string& owner) const { return owner == user || Has(Scope::kAdmin); }
};

// Says who calls. With tokens in the database every call needs one; without any, whoever can reach the
// server is user "local" with every scope, and the server listens on loopback only. Thread safe. Tokens are compared by
// SHA-256, never logged; what the database said is believed for a few seconds.
class Auth {
 public:
  explicit Auth(job::Coordinator& coordinator) : coordinator_(coordinator) {}
  // kUnauthenticated: no token, an unknown or an expired one. kPermissionDenied: none of `scopes` (bits of Scope).
  absl::StatusOr<Caller> Check(const grpc::CallbackServerContext& context, int scopes);
  absl::StatusOr<Caller> CheckToken(std::string_view token, int scopes);
  uint64_t refused() const;

 private:
  struct Entry {
    Caller caller;
    bool known = false;
    int64_t expires_us = 0, asked_us = 0;
  };
  absl::StatusOr<Entry> Find(const Digest& hash);
  absl::Status Refuse(absl::Status status);

  job::Coordinator& coordinator_;
  mutable std::mutex mutex_;
  absl::flat_hash_map<Digest, Entry, DigestHash> entries_;
  bool open_ = false;
  int64_t open_asked_us_ = 0;
  uint64_t refused_ = 0;
};

}  // namespace bakewell::rpc
