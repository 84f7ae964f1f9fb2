#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace bakewell {

// Writes a file that appears whole or not at all, also after power loss: a temporary name in the same folder, fsync,
// rename over `path`, fsync of the folder. An existing file is replaced, never changed in place. On failure nothing is
// left behind. Any number of threads and processes may write the same path; the last rename wins.
// kResourceExhausted: disk or quota full. kUnavailable: anything else that the system refuses. Both name the path.
absl::Status WriteFileAtomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
absl::Status WriteFileAtomically(const std::filesystem::path& path, std::string_view text);

// The whole file. kNotFound, kInvalidArgument where it is not a regular file, kUnavailable when reading fails.
absl::StatusOr<std::string> ReadWholeFile(const std::filesystem::path& path);

// Makes what the folder lists (new names, renames) survive power loss.
absl::Status SyncFolder(const std::filesystem::path& folder);

// The status for `error` (an errno) that `action` ("write", "rename") met at `path`.
absl::Status FileError(const std::string& action, const std::filesystem::path& path, int error);

}  // namespace bakewell
