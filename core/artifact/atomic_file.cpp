#include "core/artifact/atomic_file.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

namespace bakewell {
namespace {

namespace fs = std::filesystem;

// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int Get() const { return fd_; }
  bool Valid() const { return fd_ >= 0; }
  // 0, or the errno of close(): some file systems report a failed write only here.
  int Close() { return ::close(std::exchange(fd_, -1)) == 0 ? 0 : errno; }

 private:
  int fd_;
};

fs::path FolderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

// A name that no other writer of any process uses at the same time.
fs::path TemporaryNameFor(const fs::path& path) {
  static std::atomic<uint64_t> serial{0};
  return FolderOf(path) / absl::StrCat(".", path.filename().string(), ".", ::getpid(), ".", serial++, ".tmp");
}

// 0 or an errno.
int WriteAll(int fd, std::span<const std::byte> bytes) {
  constexpr size_t kLargestWriteBytes = size_t{1} << 30;
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), std::min(bytes.size(), kLargestWriteBytes));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes = bytes.subspan(static_cast<size_t>(written));
  }
  return 0;
}

absl::Status WriteAndSync(const fs::path& path, std::span<const std::byte> bytes) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file.Valid()) return FileError("create", path, errno);
  if (const int error = WriteAll(file.Get(), bytes)) return FileError("write", path, error);
  if (::fsync(file.Get()) != 0) return FileError("fsync", path, errno);
  if (const int error = file.Close()) return FileError("close", path, error);
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadDescriptor(int fd, const fs::path& path, size_t expected_bytes) {
  std::string bytes(expected_bytes, '\0');
  size_t size = 0;
  while (true) {
    if (size == bytes.size()) bytes.resize(size + 4096);
    const ssize_t got = ::read(fd, bytes.data() + size, bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return FileError("read", path, errno);
    if (got == 0) break;
    size += static_cast<size_t>(got);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

absl::Status FileError(const std::string& action, const fs::path& path, int error) {
  const std::string message =
      absl::StrCat("cannot ", action, " ", path.string(), ": ", std::generic_category().message(error));
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return full ? absl::ResourceExhaustedError(message) : absl::UnavailableError(message);
}

absl::Status SyncFolder(const fs::path& folder) {
  const Descriptor handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!handle.Valid()) return FileError("open", folder, errno);
  if (::fsync(handle.Get()) != 0) return FileError("fsync", folder, errno);
  return absl::OkStatus();
}

absl::Status WriteFileAtomically(const fs::path& path, std::span<const std::byte> bytes) {
  const fs::path temporary = TemporaryNameFor(path);
  absl::Status status = WriteAndSync(temporary, bytes);
  if (status.ok() && ::rename(temporary.c_str(), path.c_str()) != 0) status = FileError("rename to", path, errno);
  if (!status.ok()) {
    ::unlink(temporary.c_str());
    return status;
  }
  return SyncFolder(FolderOf(path));
}

absl::Status WriteFileAtomically(const fs::path& path, std::string_view text) {
  return WriteFileAtomically(path, std::as_bytes(std::span(text)));
}

absl::StatusOr<std::string> ReadWholeFile(const fs::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.Valid() && errno == ENOENT) return absl::NotFoundError(absl::StrCat("no such file: ", path.string()));
  if (!file.Valid()) return FileError("open", path, errno);
  struct stat about {};
  if (::fstat(file.Get(), &about) != 0) return FileError("stat", path, errno);
  if (!S_ISREG(about.st_mode)) return absl::InvalidArgumentError(absl::StrCat(path.string(), " is not a file"));
  return ReadDescriptor(file.Get(), path, static_cast<size_t>(about.st_size));
}

}  // namespace bakewell
