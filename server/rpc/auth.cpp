#include "server/rpc/auth.h"

#include <absl/strings/str_cat.h>

namespace bakewell::rpc {

namespace {

constexpr int64_t kBelievedUs = 5'000'000;
constexpr size_t kMaxEntries = 10'000;  // wrong tokens do not fill the memory
constexpr size_t kMaxTokenBytes = 512;
constexpr std::string_view kPrefix = "Bearer ";

std::string ScopeNames(int scopes) {
  std::string names;
  const char* const all[] = {"submit", "work", "read", "admin"};
  for (int i = 0; i < 4; ++i) {
    if ((scopes >> i) & 1) absl::StrAppend(&names, names.empty() ? "" : " or ", all[i]);
  }
  return names;
}

}  // namespace

absl::StatusOr<Caller> Auth::Check(const grpc::CallbackServerContext& context, int scopes) {
  const auto& metadata = context.client_metadata();
  const auto header = metadata.find("authorization");
  if (header == metadata.end()) return CheckToken("", scopes);
  std::string_view value(header->second.data(), header->second.size());
  if (value.substr(0, kPrefix.size()) != kPrefix || value.size() > kMaxTokenBytes) {
    return Refuse(absl::UnauthenticatedError("the authorization must be 'Bearer TOKEN'"));
  }
  return CheckToken(value.substr(kPrefix.size()), scopes);
}

absl::StatusOr<Caller> Auth::CheckToken(std::string_view token, int scopes) {
  const int64_t now_us = coordinator_.WallNowUs();
  const std::lock_guard lock(mutex_);
  if (open_asked_us_ == 0 || now_us - open_asked_us_ > kBelievedUs) {
    BAKEWELL_ASSIGN_OR_RETURN(const int64_t tokens, coordinator_.CountTokens());
    open_ = tokens == 0;
    open_asked_us_ = now_us;
  }
  if (open_) return Caller{"local", 15};
  if (token.empty()) return Refuse(absl::UnauthenticatedError("this coordinator needs a token"));
  BAKEWELL_ASSIGN_OR_RETURN(const Entry entry, Find(Sha256Of(token)));
  if (!entry.known) return Refuse(absl::UnauthenticatedError("the token is not known"));
  if (entry.expires_us != 0 && entry.expires_us < now_us) {
    return Refuse(absl::UnauthenticatedError("the token has expired: ask for a new one"));
  }
  if ((entry.caller.scopes & scopes) == 0) {
    return Refuse(absl::PermissionDeniedError(absl::StrCat("this needs a token with scope ", ScopeNames(scopes))));
  }
  return entry.caller;
}

absl::StatusOr<Auth::Entry> Auth::Find(const Digest& hash) {
  const int64_t now_us = coordinator_.WallNowUs();
  const auto found = entries_.find(hash);
  if (found != entries_.end() && now_us - found->second.asked_us < kBelievedUs) return found->second;
  BAKEWELL_ASSIGN_OR_RETURN(const auto row, coordinator_.FindToken(hash));
  Entry entry;
  entry.asked_us = now_us;
  if (row) {
    entry.known = true;
    entry.caller = {row->user, row->scopes};
    entry.expires_us = row->expires_us;
  }
  if (entries_.size() >= kMaxEntries) entries_.clear();
  entries_[hash] = entry;
  return entry;
}

absl::Status Auth::Refuse(absl::Status status) {
  ++refused_;
  return status;
}

uint64_t Auth::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace bakewell::rpc
