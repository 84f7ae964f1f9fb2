// Tables of people, of what went wrong and of what was learnt: token, account, failure, cost.
#include <SQLiteCpp/SQLiteCpp.h>

#include "server/store/tables.h"

namespace bakewell::store {

namespace {

using Row = SQLite::Statement;

void BindDigest(Row& row, int index, const Digest& digest) {
  row.bind(index, digest.bytes.data(), static_cast<int>(digest.bytes.size()));
}
Digest DigestAt(Row& row, int index) { return DigestFromBytes(row.getColumn(index).getString()).value_or(Digest{}); }

}  // namespace

absl::Status Tables::PutToken(const TokenRow& token) {
  return Execute("INSERT OR REPLACE INTO token VALUES(?,?,?,?,?)", [&](Row& row) {
    BindDigest(row, 1, token.hash);
    row.bind(2, token.user);
    row.bind(3, token.scopes);
    row.bind(4, token.created_us);
    row.bind(5, token.expires_us);
  });
}

absl::Status Tables::DeleteTokensOf(const std::string& user) {
  return Execute("DELETE FROM token WHERE user=?", [&](Row& row) { row.bind(1, user); });
}

absl::StatusOr<std::optional<TokenRow>> Tables::FindToken(const Digest& hash) {
  std::optional<TokenRow> token;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT user,scopes,created_us,expires_us FROM token WHERE hash=?", [&](Row& row) { BindDigest(row, 1, hash); },
      [&](Row& row) {
        token = TokenRow{hash, row.getColumn(0).getString(), row.getColumn(1).getInt(), row.getColumn(2).getInt64(),
                         row.getColumn(3).getInt64()};
      }));
  return token;
}

absl::StatusOr<int64_t> Tables::CountTokens() {
  int64_t count = 0;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT COUNT(*) FROM token", [](Row&) {}, [&](Row& row) { count = row.getColumn(0).getInt64(); }));
  return count;
}

absl::Status Tables::PutCost(const CostRow& cost) {
  return Execute("INSERT OR REPLACE INTO cost VALUES(?,?,?,?,?)", [&](Row& row) {
    row.bind(1, cost.kind);
    row.bind(2, cost.code_version);
    row.bind(3, cost.run_ratio);
    row.bind(4, cost.lease_ratio);
    row.bind(5, cost.samples);
  });
}

absl::StatusOr<std::vector<CostRow>> Tables::Costs() {
  std::vector<CostRow> costs;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT kind,code_version,run_ratio,lease_ratio,samples FROM cost", [](Row&) {},
      [&](Row& row) {
        costs.push_back({row.getColumn(0).getString(), row.getColumn(1).getUInt(), row.getColumn(2).getDouble(),
                         row.getColumn(3).getDouble(), row.getColumn(4).getInt64()});
      }));
  return costs;
}

absl::Status Tables::PutAccount(const AccountRow& account) {
  return Execute("INSERT OR REPLACE INTO account VALUES(?,?,?,?,?)", [&](Row& row) {
    row.bind(1, account.user);
    row.bind(2, account.weight);
    row.bind(3, account.max_jobs);
    row.bind(4, account.max_scene_bytes);
    row.bind(5, account.max_tasks);
  });
}

absl::StatusOr<std::optional<AccountRow>> Tables::FindAccount(const std::string& user) {
  std::optional<AccountRow> account;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT weight,max_jobs,max_scene_bytes,max_tasks FROM account WHERE user=?",
      [&](Row& row) { row.bind(1, user); },
      [&](Row& row) {
        account = AccountRow{user, row.getColumn(0).getInt64(), row.getColumn(1).getInt64(),
                             row.getColumn(2).getInt64(), row.getColumn(3).getInt64()};
      }));
  return account;
}

absl::Status Tables::InsertFailure(const FailureRow& failure) {
  return Execute("INSERT INTO failure(at_us,job,kind,key,worker,reason) VALUES(?,?,?,?,?,?)", [&](Row& row) {
    row.bind(1, failure.at_us);
    row.bind(2, failure.job);
    row.bind(3, failure.kind);
    BindDigest(row, 4, failure.key.digest);
    row.bind(5, failure.worker);
    row.bind(6, failure.reason);
  });
}

absl::StatusOr<std::vector<FailureRow>> Tables::RecentFailures(int64_t job, int limit) {
  std::vector<FailureRow> failures;
  BAKEWELL_RETURN_IF_ERROR(Query(
      "SELECT at_us,job,kind,key,worker,reason FROM failure WHERE ?1=0 OR job=?1 ORDER BY id DESC LIMIT ?2",
      [&](Row& row) {
        row.bind(1, job);
        row.bind(2, limit);
      },
      [&](Row& row) {
        failures.push_back({row.getColumn(0).getInt64(), row.getColumn(1).getInt64(), row.getColumn(2).getString(),
                            TaskKey{DigestAt(row, 3)}, row.getColumn(4).getString(), row.getColumn(5).getString()});
      }));
  return failures;
}

}  // namespace bakewell::store
