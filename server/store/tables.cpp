#include "server/store/tables.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <absl/container/flat_hash_map.h>
#include <absl/strings/str_cat.h>

#include "server/store/database.h"

namespace bakewell::store {

namespace {

using Row = SQLite::Statement;

void BindBytes(Row& row, int index, const std::string& bytes) {
  row.bind(index, bytes.data(), static_cast<int>(bytes.size()));
}
void BindDigest(Row& row, int index, const Digest& digest) {
  row.bind(index, digest.bytes.data(), static_cast<int>(digest.bytes.size()));
}
std::string BytesAt(Row& row, int index) { return row.getColumn(index).getString(); }
int64_t NumberAt(Row& row, int index) { return row.getColumn(index).getInt64(); }
Digest DigestAt(Row& row, int index) { return DigestFromBytes(BytesAt(row, index)).value_or(Digest{}); }

constexpr char kJobColumns[] =
    "SELECT id,user,client_key,name,state,priority,scene,settings,submitted_us,finished_us,reason,tasks,known_tasks,"
    "run_us,artifacts,code,phases FROM job ";

JobRow JobAt(Row& row) {
  JobRow job;
  job.id = NumberAt(row, 0);
  job.user = BytesAt(row, 1);
  job.client_key = BytesAt(row, 2);
  job.name = BytesAt(row, 3);
  job.state = static_cast<JobState>(NumberAt(row, 4));
  job.priority = static_cast<int>(NumberAt(row, 5));
  job.scene = DigestAt(row, 6);
  job.settings = BytesAt(row, 7);
  job.submitted_us = NumberAt(row, 8);
  job.finished_us = NumberAt(row, 9);
  job.reason = BytesAt(row, 10);
  job.tasks = NumberAt(row, 11);
  job.known_tasks = NumberAt(row, 12);
  job.run_us = NumberAt(row, 13);
  job.artifacts = BytesAt(row, 14);
  job.code = static_cast<int>(NumberAt(row, 15));
  job.phases = BytesAt(row, 16);
  return job;
}

BlobRow BlobAt(Row& row) { return {DigestAt(row, 0), NumberAt(row, 1), NumberAt(row, 2), NumberAt(row, 3)}; }

}  // namespace

struct Tables::Cache {
  absl::flat_hash_map<const char*, std::unique_ptr<SQLite::Statement>> statements;  // by the literal's address
};

Tables::Tables(std::unique_ptr<SQLite::Database> database)
    : database_(std::move(database)), cache_(std::make_unique<Cache>()) {}

Tables::~Tables() = default;

absl::StatusOr<std::unique_ptr<Tables>> Tables::Open(const std::filesystem::path& path, Durability durability) {
  BAKEWELL_ASSIGN_OR_RETURN(auto database, OpenDatabase(path, durability));
  return std::make_unique<Tables>(std::move(database));
}

absl::StatusOr<std::unique_ptr<Tables>> Tables::OpenReadOnly(const std::filesystem::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(auto database, store::OpenReadOnly(path));
  return std::make_unique<Tables>(std::move(database));
}

SQLite::Statement& Tables::Prepared(const char* sql) {
  auto& statement = cache_->statements[sql];
  if (!statement) statement = std::make_unique<SQLite::Statement>(*database_, sql);
  return *statement;
}

absl::Status Tables::Query(const char* sql, const std::function<void(Row&)>& bind,
                           const std::function<void(Row&)>& row) {
  SQLite::Statement* statement = nullptr;
  const absl::Status status = Guarded([&] {
    statement = &Prepared(sql);
    bind(*statement);
    while (statement->executeStep()) row(*statement);
  });
  if (statement != nullptr) {
    statement->tryReset();
    statement->clearBindings();
  }
  return status;
}

absl::Status Tables::Execute(const char* sql, const std::function<void(Row&)>& bind) {
  return Query(sql, bind, [](Row&) {});
}

absl::Status Tables::Begin() {
  return Execute("BEGIN IMMEDIATE", [](Row&) {});
}
absl::Status Tables::Commit() {
  return Execute("COMMIT", [](Row&) {});
}

void Tables::Rollback() {
  // SQLite may have rolled back by itself (disk full); that there is nothing to undo is no fault.
  Execute("ROLLBACK", [](Row&) {}).IgnoreError();
}

absl::Status Tables::Apart(const std::function<absl::Status()>& work) {
  BAKEWELL_RETURN_IF_ERROR(Execute("SAVEPOINT item", [](Row&) {}));
  const absl::Status status = work();
  if (!status.ok()) Execute("ROLLBACK TO item", [](Row&) {}).IgnoreError();
  const absl::Status released = Execute("RELEASE item", [](Row&) {});
  return status.ok() ? released : status;
}

absl::StatusOr<int64_t> Tables::NextEpoch() {
  int64_t epoch = 0;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "UPDATE meta SET value=value+1 WHERE name='epoch' RETURNING value", [](Row&) {},
      [&](Row& row) { epoch = NumberAt(row, 0); }));
  return epoch;
}

absl::StatusOr<int64_t> Tables::InsertJob(const JobRow& job) {
  BAKEWELL_RETURN_IF_ERROR(
      Execute("INSERT INTO job(id,user,client_key,name,state,priority,scene,settings,submitted_us,tasks,known_tasks) "
              "VALUES(NULLIF(?,0),?,?,?,?,?,?,?,?,?,?)",
              [&](Row& row) {
                row.bind(1, job.id);
                row.bind(2, job.user);
                row.bind(3, job.client_key);
                row.bind(4, job.name);
                row.bind(5, static_cast<int>(job.state));
                row.bind(6, job.priority);
                BindDigest(row, 7, job.scene);
                BindBytes(row, 8, job.settings);
                row.bind(9, job.submitted_us);
                row.bind(10, job.tasks);
                row.bind(11, job.known_tasks);
              }));
  BAKEWELL_RETURN_IF_ERROR(AddBlobRefs(job.scene, 1));
  return database_->getLastInsertRowid();
}

absl::Status Tables::UpdateJob(const JobRow& job) {
  return Execute(
      "UPDATE job SET state=?,priority=?,finished_us=?,reason=?,tasks=?,known_tasks=?,run_us=?,artifacts=?,code=?,"
      "phases=? WHERE id=?",
      [&](Row& row) {
        row.bind(1, static_cast<int>(job.state));
        row.bind(2, job.priority);
        row.bind(3, job.finished_us);
        row.bind(4, job.reason);
        row.bind(5, job.tasks);
        row.bind(6, job.known_tasks);
        row.bind(7, job.run_us);
        BindBytes(row, 8, job.artifacts);
        row.bind(9, job.code);
        BindBytes(row, 10, job.phases);
        row.bind(11, job.id);
      });
}

absl::StatusOr<std::optional<JobRow>> Tables::FindJob(int64_t id) {
  std::optional<JobRow> job;
  static const std::string sql = absl::StrCat(kJobColumns, "WHERE id=?");
  BAKEWELL_RETURN_IF_ERROR(Query(
      sql.c_str(), [&](Row& row) { row.bind(1, id); }, [&](Row& row) { job = JobAt(row); }));
  return job;
}

absl::StatusOr<std::optional<JobRow>> Tables::FindJobByKey(const std::string& user, const std::string& client_key) {
  std::optional<JobRow> job;
  static const std::string sql = absl::StrCat(kJobColumns, "WHERE user=? AND client_key=?");
  BAKEWELL_RETURN_IF_ERROR(Query(
      sql.c_str(),
      [&](Row& row) {
        row.bind(1, user);
        row.bind(2, client_key);
      },
      [&](Row& row) { job = JobAt(row); }));
  return job;
}

absl::StatusOr<std::vector<JobRow>> Tables::ListJobs(const JobFilter& filter) {
  std::vector<JobRow> jobs;
  static const std::string sql =
      absl::StrCat(kJobColumns, "WHERE id<? AND (?2='' OR user=?2) AND (?3<0 OR state=?3) ORDER BY id DESC LIMIT ?4");
  BAKEWELL_RETURN_IF_ERROR(Query(
      sql.c_str(),
      [&](Row& row) {
        row.bind(1, filter.below_id);
        row.bind(2, filter.user);
        row.bind(3, filter.state ? static_cast<int>(*filter.state) : -1);
        row.bind(4, filter.limit);
      },
      [&](Row& row) { jobs.push_back(JobAt(row)); }));
  return jobs;
}

absl::StatusOr<int64_t> Tables::LastJobId() {
  int64_t id = 0;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT seq FROM sqlite_sequence WHERE name='job'", [](Row&) {}, [&](Row& row) { id = NumberAt(row, 0); }));
  return id;
}

absl::Status Tables::InsertStage(int64_t job, int64_t stage, const std::string& graph) {
  return Execute("INSERT OR REPLACE INTO job_stage VALUES(?,?,?)", [&](Row& row) {
    row.bind(1, job);
    row.bind(2, stage);
    BindBytes(row, 3, graph);
  });
}

absl::StatusOr<std::vector<std::string>> Tables::Stages(int64_t job) {
  std::vector<std::string> stages;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT graph FROM job_stage WHERE job=? ORDER BY stage", [&](Row& row) { row.bind(1, job); },
      [&](Row& row) { stages.push_back(BytesAt(row, 0)); }));
  return stages;
}

absl::Status Tables::DeleteStages(int64_t job) {
  return Execute("DELETE FROM job_stage WHERE job=?", [&](Row& row) { row.bind(1, job); });
}

absl::Status Tables::AddRefsOf(const TaskOutputs& outputs, int64_t refs) {
  for (const TaskOutput& output : outputs) BAKEWELL_RETURN_IF_ERROR(AddBlobRefs(output.digest, refs));
  return absl::OkStatus();
}

absl::Status Tables::InsertKnown(const TaskKey& key, const KnownTask& known) {
  bool added = false;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "INSERT OR IGNORE INTO catalogue VALUES(?,?,?,?) RETURNING 1",
      [&](Row& row) {
        BindDigest(row, 1, key.digest);
        BindBytes(row, 2, SerializeOutputs(known.outputs));
        row.bind(3, known.run_us);
        row.bind(4, known.used_us);
      },
      [&](Row&) { added = true; }));
  return added ? AddRefsOf(known.outputs, 1) : absl::OkStatus();
}

absl::StatusOr<std::optional<KnownTask>> Tables::FindKnown(const TaskKey& key) {
  std::optional<KnownTask> known;
  std::string outputs;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT outputs,run_us,used_us FROM catalogue WHERE key=?", [&](Row& row) { BindDigest(row, 1, key.digest); },
      [&](Row& row) {
        known = KnownTask{{}, NumberAt(row, 1), NumberAt(row, 2)};
        outputs = BytesAt(row, 0);
      }));
  if (!known) return known;
  BAKEWELL_ASSIGN_OR_RETURN(known->outputs, ParseOutputs(outputs));
  return known;
}

absl::Status Tables::TouchKnown(const TaskKey& key, int64_t used_us) {
  return Execute("UPDATE catalogue SET used_us=?1 WHERE key=?2 AND used_us<?1", [&](Row& row) {
    row.bind(1, used_us);
    BindDigest(row, 2, key.digest);
  });
}

absl::Status Tables::DeleteKnown(const TaskKey& key) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::optional<KnownTask> known, FindKnown(key));
  if (!known) return absl::OkStatus();
  BAKEWELL_RETURN_IF_ERROR(AddRefsOf(known->outputs, -1));
  return Execute("DELETE FROM catalogue WHERE key=?", [&](Row& row) { BindDigest(row, 1, key.digest); });
}

absl::StatusOr<std::vector<Tables::UsedKey>> Tables::OldestKnown(const UsedKey& after, int limit) {
  std::vector<UsedKey> keys;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT used_us,key FROM catalogue WHERE (used_us,key)>(?,?) ORDER BY used_us,key LIMIT ?",
      [&](Row& row) {
        row.bind(1, after.used_us);
        BindDigest(row, 2, after.key.digest);
        row.bind(3, limit);
      },
      [&](Row& row) {
        keys.push_back({NumberAt(row, 0), TaskKey{DigestAt(row, 1)}});
      }));
  return keys;
}

absl::StatusOr<int64_t> Tables::CountKnown() {
  int64_t count = 0;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT COUNT(*) FROM catalogue", [](Row&) {}, [&](Row& row) { count = NumberAt(row, 0); }));
  return count;
}

absl::Status Tables::InsertBlob(const BlobRow& blob) {
  return Execute(
      "INSERT INTO blob VALUES(?,?,0,?) ON CONFLICT(digest) DO UPDATE SET size_bytes=excluded.size_bytes,"
      "touched_us=MAX(touched_us,excluded.touched_us)",
      [&](Row& row) {
        BindDigest(row, 1, blob.digest);
        row.bind(2, blob.size_bytes);
        row.bind(3, blob.touched_us);
      });
}

absl::Status Tables::AddBlobRefs(const Digest& digest, int64_t refs) {
  // A row that is missing (its file was found corrupt) is made again, of unknown size, by the reference to it.
  return Execute("INSERT INTO blob VALUES(?1,-1,?2,0) ON CONFLICT(digest) DO UPDATE SET refs=refs+?2", [&](Row& row) {
    BindDigest(row, 1, digest);
    row.bind(2, refs);
  });
}

absl::Status Tables::DeleteBlob(const Digest& digest) {
  return Execute("DELETE FROM blob WHERE digest=?", [&](Row& row) { BindDigest(row, 1, digest); });
}

absl::Status Tables::ForEachBlob(const std::function<void(const BlobRow&)>& visit) {
  return Query(
      "SELECT digest,size_bytes,refs,touched_us FROM blob WHERE size_bytes>=0", [](Row&) {},
      [&](Row& row) { visit(BlobAt(row)); });
}

absl::StatusOr<std::vector<BlobRow>> Tables::UnreferencedBlobs(int64_t touched_before_us, int limit) {
  std::vector<BlobRow> blobs;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT digest,size_bytes,refs,touched_us FROM blob WHERE refs<=0 AND touched_us<? ORDER BY touched_us LIMIT ?",
      [&](Row& row) {
        row.bind(1, touched_before_us);
        row.bind(2, limit);
      },
      [&](Row& row) { blobs.push_back(BlobAt(row)); }));
  return blobs;
}

}  // namespace bakewell::store
