#include "server/rpc/refusal_log.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

namespace bakewell::rpc {

namespace {

constexpr int64_t kOnceUs = 60'000'000;
constexpr size_t kMaxEntries = 1000;  // many hosts do not fill the memory
constexpr size_t kMaxReason = 200;

bool IsCallersFault(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kDataLoss:
      return true;
    default:
      return false;
  }
}

// Without the port, which every connection has anew.
std::string HostOf(const std::string& peer) { return peer.substr(0, peer.rfind(':')); }

}  // namespace

void RefusalLog::Note(const std::string& peer, const absl::Status& status, int64_t now_us) {
  if (!IsCallersFault(status.code())) return;
  const std::string host = HostOf(peer);
  std::string line;
  {
    const std::lock_guard lock(mutex_);
    if (entries_.size() >= kMaxEntries) entries_.clear();
    Entry& entry = entries_[{host, static_cast<int>(status.code())}];
    if (entry.said_us != 0 && now_us - entry.said_us < kOnceUs) {
      ++entry.unsaid;
      return;
    }
    line = absl::StrCat("refused ", absl::CEscape(host), ": ", absl::StatusCodeToString(status.code()), ": ",
                        absl::CEscape(status.message().substr(0, kMaxReason)));
    if (entry.unsaid > 0) absl::StrAppend(&line, " (and ", entry.unsaid, " more since the last line)");
    entry = {now_us, 0};
  }
  sink_(line);
}

}  // namespace bakewell::rpc
