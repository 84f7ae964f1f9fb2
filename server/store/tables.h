#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/task.h"
#include "core/base/status.h"
#include "server/store/durability.h"

namespace SQLite {
class Database;
class Statement;
}  // namespace SQLite

namespace bakewell::store {

// Rows of schema/*.sql. Times are microseconds since 1970.
enum class JobState : int { kRunning = 0, kDone = 1, kFailed = 2, kCancelled = 3 };

struct JobRow {
  int64_t id = 0;  // 0: given by Insert
  std::string user, client_key, name;
  JobState state = JobState::kRunning;
  int priority = 0;
  Digest scene;
  std::string settings;
  int64_t submitted_us = 0, finished_us = 0;
  std::string reason;
  int64_t tasks = 0, known_tasks = 0, run_us = 0;
  std::string artifacts;  // SerializeOutputs of the finished job
  int code = 0;           // absl::StatusCode of `reason`
  std::string phases;     // server/job SerializePhases of the finished job
};

struct KnownTask {
  TaskOutputs outputs;
  int64_t run_us = 0, used_us = 0;
};

struct BlobRow {
  Digest digest;
  int64_t size_bytes = 0, refs = 0, touched_us = 0;
};

struct TokenRow {
  Digest hash;
  std::string user;
  int scopes = 0;
  int64_t created_us = 0, expires_us = 0;
};

struct AccountRow {
  std::string user;
  int64_t weight = 1, max_jobs = 0, max_scene_bytes = 0, max_tasks = 0;
};

struct FailureRow {
  int64_t at_us = 0, job = 0;
  std::string kind;
  TaskKey key;
  std::string worker, reason;
};

struct CostRow {
  std::string kind;
  uint32_t code_version = 0;
  double run_ratio = 1, lease_ratio = 1;
  int64_t samples = 0;
};

struct JobFilter {
  std::string user;               // empty: all
  std::optional<JobState> state;  // nothing: all
  int64_t below_id = INT64_MAX;   // page: ids below this, newest first
  int limit = 100;
};

// A connection and its prepared statements. Not thread safe: the Writer owns the one that writes. Errors as Guarded().
class Tables {
 public:
  explicit Tables(std::unique_ptr<SQLite::Database> database);
  static absl::StatusOr<std::unique_ptr<Tables>> Open(const std::filesystem::path& path,
                                                      Durability durability = Durability::kSafe);
  static absl::StatusOr<std::unique_ptr<Tables>> OpenReadOnly(const std::filesystem::path& path);
  ~Tables();

  absl::Status Begin();
  absl::Status Commit();
  void Rollback();
  // Runs `work` inside the open transaction; if it fails its changes are undone, those of others stay.
  absl::Status Apart(const std::function<absl::Status()>& work);
  // Counts a start of the coordinator; the new value.
  absl::StatusOr<int64_t> NextEpoch();
  absl::StatusOr<int64_t> InsertJob(const JobRow& job);
  absl::Status UpdateJob(const JobRow& job);  // all but id, user, client_key
  absl::StatusOr<std::optional<JobRow>> FindJob(int64_t id);
  absl::StatusOr<std::optional<JobRow>> FindJobByKey(const std::string& user, const std::string& client_key);
  absl::StatusOr<std::vector<JobRow>> ListJobs(const JobFilter& filter);
  absl::StatusOr<int64_t> LastJobId();
  absl::Status InsertStage(int64_t job, int64_t stage, const std::string& graph);
  absl::StatusOr<std::vector<std::string>> Stages(int64_t job);
  absl::Status DeleteStages(int64_t job);

  // Known tasks. Insert is harmless if the key is known; it adds references to the outputs' blobs.
  absl::Status InsertKnown(const TaskKey& key, const KnownTask& known);
  absl::StatusOr<std::optional<KnownTask>> FindKnown(const TaskKey& key);
  absl::Status TouchKnown(const TaskKey& key, int64_t used_us);
  absl::Status DeleteKnown(const TaskKey& key);
  // Up to `limit` keys, least recently used first, used after `used_us` (or equal and key above `after`).
  struct UsedKey {
    int64_t used_us;
    TaskKey key;
  };
  absl::StatusOr<std::vector<UsedKey>> OldestKnown(const UsedKey& after, int limit);
  absl::StatusOr<int64_t> CountKnown();

  absl::Status InsertBlob(const BlobRow& blob);  // known already: touched
  absl::Status AddBlobRefs(const Digest& digest, int64_t refs);
  absl::Status DeleteBlob(const Digest& digest);
  absl::Status ForEachBlob(const std::function<void(const BlobRow&)>& visit);
  absl::StatusOr<std::vector<BlobRow>> UnreferencedBlobs(int64_t touched_before_us, int limit);

  absl::Status PutToken(const TokenRow& token);
  absl::Status DeleteTokensOf(const std::string& user);
  absl::StatusOr<std::optional<TokenRow>> FindToken(const Digest& hash);
  absl::StatusOr<int64_t> CountTokens();
  absl::Status PutAccount(const AccountRow& account);
  absl::StatusOr<std::optional<AccountRow>> FindAccount(const std::string& user);
  absl::Status PutCost(const CostRow& cost);
  absl::StatusOr<std::vector<CostRow>> Costs();
  absl::Status InsertFailure(const FailureRow& failure);
  absl::StatusOr<std::vector<FailureRow>> RecentFailures(int64_t job, int limit);  // job 0: of all

 private:
  SQLite::Statement& Prepared(const char* sql);
  absl::Status Execute(const char* sql, const std::function<void(SQLite::Statement&)>& bind);
  absl::Status Query(const char* sql, const std::function<void(SQLite::Statement&)>& bind,
                     const std::function<void(SQLite::Statement&)>& row);
  absl::Status AddRefsOf(const TaskOutputs& outputs, int64_t refs);

  struct Cache;
  std::unique_ptr<SQLite::Database> database_;
  std::unique_ptr<Cache> cache_;
};

}  // namespace bakewell::store
