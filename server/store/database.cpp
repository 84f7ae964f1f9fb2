#include "server/store/database.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <absl/strings/str_cat.h>
#include <sqlite3.h>

#include "server/store/migrations.h"

namespace bakewell::store {

namespace {

absl::Status FromException(const SQLite::Exception& error) {
  const std::string text = absl::StrCat("database: ", error.what());
  switch (error.getErrorCode() & 0xff) {
    case SQLITE_FULL:
      return absl::ResourceExhaustedError(absl::StrCat(text, " (free some disk space)"));
    case SQLITE_IOERR:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::UnavailableError(text);
    case SQLITE_CONSTRAINT:
      return absl::AlreadyExistsError(text);
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::DataLossError(absl::StrCat(text, " (restore the last backup)"));
    default:
      return absl::InternalError(text);
  }
}

int VersionOf(SQLite::Database& database) { return database.execAndGet("PRAGMA user_version").getInt(); }

void Migrate(SQLite::Database& database) {
  for (int version = VersionOf(database); version < SchemaVersion(); ++version) {
    SQLite::Transaction transaction(database);
    database.exec(kMigrations[version]);
    database.exec(absl::StrCat("PRAGMA user_version=", version + 1));
    transaction.commit();
  }
}

// `make` opens the connection.
absl::StatusOr<std::unique_ptr<SQLite::Database>> Open(const std::filesystem::path& path, int flags) {
  std::unique_ptr<SQLite::Database> database;
  BAKEWELL_RETURN_IF_ERROR(Guarded([&] {
    database = std::make_unique<SQLite::Database>(path.string(), flags);
    database->setBusyTimeout(10000);
    database->exec("PRAGMA cache_size=-65536");
  }));
  return database;
}

}  // namespace

int SchemaVersion() { return static_cast<int>(std::size(kMigrations)); }

absl::Status Guarded(const std::function<void()>& work) {
  try {
    work();
    return absl::OkStatus();
  } catch (const SQLite::Exception& error) {
    return FromException(error);
  }
}

absl::StatusOr<std::unique_ptr<SQLite::Database>> OpenDatabase(const std::filesystem::path& path,
                                                               Durability durability) {
  BAKEWELL_ASSIGN_OR_RETURN(auto database, Open(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE));
  int version = 0;
  BAKEWELL_RETURN_IF_ERROR(Guarded([&] { version = VersionOf(*database); }));
  if (version > SchemaVersion()) {
    return absl::FailedPreconditionError(absl::StrCat(path.string(), " has schema version ", version,
                                                      "; this program knows up to ", SchemaVersion(),
                                                      ": run the bakewell-server that wrote it, or a newer one"));
  }
  BAKEWELL_RETURN_IF_ERROR(Guarded([&] {
    database->exec("PRAGMA journal_mode=WAL");
    database->exec(durability == Durability::kSafe ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=OFF");
    database->exec("PRAGMA wal_autocheckpoint=4000");
    Migrate(*database);
  }));
  return database;
}

absl::StatusOr<std::unique_ptr<SQLite::Database>> OpenReadOnly(const std::filesystem::path& path) {
  return Open(path, SQLite::OPEN_READONLY);
}

absl::Status BackupDatabase(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (std::filesystem::exists(to)) {
    return absl::AlreadyExistsError(absl::StrCat(to.string(), " exists: name a new file for the backup"));
  }
  BAKEWELL_ASSIGN_OR_RETURN(const auto source, Open(from, SQLite::OPEN_READONLY));
  return Guarded([&] {
    SQLite::Statement copy(*source, "VACUUM INTO ?");
    copy.bind(1, to.string());
    copy.executeStep();
  });
}

}  // namespace bakewell::store
