#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "server/sched/types.h"
#include "server/store/tables.h"

namespace bakewell::job {

struct Options {
  std::filesystem::path folder;  // database and blobs; made if it is missing
  int64_t quota_bytes = 0;       // of the blob store; 0: none
  store::Durability durability = store::Durability::kSafe;
  store::AccountRow defaults;  // limits of users without a row of their own
  sched::Options sched;
  // What nobody needs is collected this often, and ten times as often while more than `keep_bytes` are stored: then
  // known results go too, those used longest ago first. 0 s: only when an operator asks. 0 bytes: nine tenths of the
  // quota, and everything without one.
  std::chrono::seconds collect_every{3600};
  int64_t keep_bytes = 0;
  int io_threads = 8;
  std::function<sched::Time()> steady_now;    // default: std::chrono::steady_clock
  std::function<int64_t()> wall_now_us;       // default: std::chrono::system_clock, microseconds since 1970
  std::function<void(std::string_view)> log;  // one line an event; default: nowhere
};

}  // namespace bakewell::job
