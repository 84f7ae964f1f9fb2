#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "core/base/status.h"
#include "server/store/durability.h"

namespace SQLite {
class Database;
}

namespace bakewell::store {

// Opens (and creates) the database file, with WAL and synchronous=FULL (Durability::kScratch: OFF), and applies the
// migrations of schema/ that it lacks, each in a transaction. kFailedPrecondition for a database that a newer bakewell
// wrote: it is left untouched. Every connection is used by one thread at a time. SQLite's exceptions end in this
// folder.
absl::StatusOr<std::unique_ptr<SQLite::Database>> OpenDatabase(const std::filesystem::path& path,
                                                               Durability durability = Durability::kSafe);

// A second connection that only reads; sees what was committed when its statement starts.
absl::StatusOr<std::unique_ptr<SQLite::Database>> OpenReadOnly(const std::filesystem::path& path);

// The schema version that this program writes.
int SchemaVersion();

// Copies a database that may be in use, consistently, to a new file, and syncs it. kAlreadyExists if `to` exists.
absl::Status BackupDatabase(const std::filesystem::path& from, const std::filesystem::path& to);

// Runs `work`; an SQLite exception becomes a status: kResourceExhausted disk full, kUnavailable busy, kAlreadyExists
// constraint, kDataLoss corrupt, kInternal otherwise.
absl::Status Guarded(const std::function<void()>& work);

}  // namespace bakewell::store
