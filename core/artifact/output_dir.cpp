#include "core/artifact/output_dir.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <utility>

#include "core/artifact/atomic_file.h"

namespace bakewell {
namespace {

namespace fs = std::filesystem;

constexpr char kStagingPrefix[] = ".bakewell-";
constexpr char kManifest[] = "manifest.json";

bool Exists(const fs::path& path) {
  std::error_code unknown_means_no;
  return fs::exists(path, unknown_means_no);
}

// The folders on the way to `folder` that are not there yet, outermost first.
std::vector<fs::path> MissingFolders(const fs::path& folder) {
  std::vector<fs::path> missing;
  for (fs::path at = folder; !at.empty() && !Exists(at); at = at.parent_path()) {
    missing.push_back(at);
    if (at == at.parent_path()) break;
  }
  std::reverse(missing.begin(), missing.end());
  return missing;
}

void RemoveEmptyFolders(const std::vector<fs::path>& folders) {
  std::error_code ignored;
  for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder) fs::remove(*folder, ignored);
}

// A descriptor that holds the exclusive lock of `folder`, or -1.
int TryLock(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd >= 0 && ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  if (fd >= 0) ::close(fd);
  return -1;
}

// Holds the lock of a folder, if the file system has locks; waits for whoever has it.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) : fd_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    while (fd_ >= 0 && ::flock(fd_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~FolderLock() {
    if (fd_ >= 0) ::close(fd_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  const int fd_;
};

// A staging folder whose lock is free has lost its owner.
void RemoveAbandoned(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const bool staging = entry.path().filename().string().rfind(kStagingPrefix, 0) == 0;
    if (!staging) continue;
    const int lock = TryLock(entry.path());
    if (lock < 0) continue;
    fs::remove_all(entry.path(), ignored);
    ::close(lock);
  }
}

absl::Status SyncFile(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return FileError("open", path, errno);
  const int error = ::fsync(fd) == 0 ? 0 : errno;
  ::close(fd);
  return error == 0 ? absl::OkStatus() : FileError("fsync", path, error);
}

absl::Status Move(const fs::path& from, const fs::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) return FileError("rename to", to, errno);
  return absl::OkStatus();
}

absl::StatusOr<std::vector<fs::path>> SyncedFiles(const fs::path& staging) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(staging, error)) files.push_back(entry.path());
  if (error) return FileError("list", staging, error.value());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) BAKEWELL_RETURN_IF_ERROR(SyncFile(file));
  return files;
}

absl::Status RemoveManifest(const fs::path& folder) {
  const fs::path manifest = folder / kManifest;
  if (::unlink(manifest.c_str()) != 0 && errno != ENOENT) return FileError("remove", manifest, errno);
  return SyncFolder(folder);
}

}  // namespace

absl::StatusOr<OutputDir> OutputDir::Create(const fs::path& folder) {
  OutputDir out;
  out.folder_ = folder.has_filename() ? folder : folder.parent_path();
  std::error_code error;
  if (Exists(out.folder_) && !fs::is_directory(out.folder_, error)) {
    return absl::InvalidArgumentError(absl::StrCat(out.folder_.string(), " is a file, not a folder"));
  }
  out.made_ = MissingFolders(out.folder_);
  fs::create_directories(out.folder_, error);
  if (error) return FileError("create", out.folder_, error.value());

  // Nobody makes a staging folder meanwhile that is not locked yet.
  const FolderLock lock(out.folder_);
  RemoveAbandoned(out.folder_);
  std::string pattern = (out.folder_ / absl::StrCat(kStagingPrefix, "XXXXXX")).string();
  if (::mkdtemp(pattern.data()) == nullptr) return FileError("create a folder in", out.folder_, errno);
  out.staging_ = pattern;
  out.lock_ = TryLock(out.staging_);
  return out;
}

OutputDir::OutputDir(OutputDir&& other) noexcept
    : folder_(std::move(other.folder_)),
      staging_(std::exchange(other.staging_, {})),
      made_(std::exchange(other.made_, {})),
      lock_(std::exchange(other.lock_, -1)) {}

OutputDir::~OutputDir() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  if (lock_ >= 0) ::close(lock_);
  RemoveEmptyFolders(made_);
}

absl::StatusOr<std::vector<fs::path>> OutputDir::Commit() {
  BAKEWELL_ASSIGN_OR_RETURN(std::vector<fs::path> files, SyncedFiles(staging_));
  BAKEWELL_RETURN_IF_ERROR(RemoveManifest(folder_));
  for (const fs::path& file : files) {
    if (file.filename() != kManifest) BAKEWELL_RETURN_IF_ERROR(Move(file, folder_ / file.filename()));
  }
  BAKEWELL_RETURN_IF_ERROR(SyncFolder(folder_));
  if (const fs::path manifest = staging_ / kManifest; Exists(manifest)) {
    BAKEWELL_RETURN_IF_ERROR(Move(manifest, folder_ / kManifest));
    BAKEWELL_RETURN_IF_ERROR(SyncFolder(folder_));
  }
  for (fs::path& file : files) file = folder_ / file.filename();
  return files;
}

}  // namespace bakewell
