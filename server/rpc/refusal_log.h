#pragma once

#include <absl/container/flat_hash_map.h>

#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/status.h"

namespace bakewell::rpc {

// Says who was refused and why, once: what the same host is refused for the same reason (status code) within a minute
// is counted, and the count is said with the next line. Hostile text is escaped and cut short. Thread safe.
class RefusalLog {
 public:
  using Sink = std::function<void(std::string_view)>;
  explicit RefusalLog(Sink sink) : sink_(std::move(sink)) {}

  // `peer` as gRPC names it: "ipv4:127.0.0.1:4711". Only what a caller is to blame for is said: kUnauthenticated,
  // kPermissionDenied, kInvalidArgument, kResourceExhausted, kDataLoss.
  void Note(const std::string& peer, const absl::Status& status, int64_t now_us);

 private:
  struct Entry {
    int64_t said_us = 0, unsaid = 0;
  };
  const Sink sink_;
  std::mutex mutex_;
  absl::flat_hash_map<std::pair<std::string, int>, Entry> entries_;  // by host and code
};

}  // namespace bakewell::rpc
