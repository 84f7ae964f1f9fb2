#include "server/store/blobs.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace bakewell::store {

namespace {

namespace fs = std::filesystem;

constexpr size_t kBlockBytes = 1 << 20;

absl::Status FromErrno(int error, const std::string& what) {
  const std::string text = absl::StrCat("store: ", what, ": ", std::strerror(error));
  if (error == ENOSPC || error == EDQUOT) return absl::ResourceExhaustedError(absl::StrCat(text, " (free some space)"));
  if (error == ENOENT) return absl::NotFoundError(text);
  return absl::UnavailableError(text);
}

absl::Status SyncFolder(const fs::path& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return FromErrno(errno, absl::StrCat("opening ", folder.string()));
  const int result = fsync(file), error = errno;
  close(file);
  return result == 0 ? absl::OkStatus() : FromErrno(error, absl::StrCat("syncing ", folder.string()));
}

absl::Status MakeFolders(const fs::path& root, Durability durability) {
  std::error_code error;
  for (const char* folder : {"incoming", "quarantine", "blobs"}) fs::create_directories(root / folder, error);
  for (const fs::directory_entry& left : fs::directory_iterator(root / "incoming", error)) fs::remove(left, error);
  const auto made = [&](const fs::path& folder) -> absl::Status {
    if (fs::is_directory(folder, error)) return absl::OkStatus();
    return absl::FailedPreconditionError(absl::StrCat("store: cannot make folders in ", root.string()));
  };
  if (durability == Durability::kScratch) return made(root / "blobs");
  constexpr char kDigits[] = "0123456789abcdef";
  for (int i = 0; i < 256; ++i) {
    const char name[] = {kDigits[i >> 4], kDigits[i & 15], 0};
    fs::create_directory(root / "blobs" / name, error);
  }
  BAKEWELL_RETURN_IF_ERROR(made(root / "blobs" / "ff"));
  return SyncFolder(root / "blobs");
}

}  // namespace

absl::StatusOr<std::unique_ptr<BlobStore>> BlobStore::Open(const fs::path& root, int64_t quota_bytes,
                                                           Durability durability) {
  const fs::path path = root / "lock";
  const int lock = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock < 0) return FromErrno(errno, absl::StrCat("opening ", path.string()));
  std::unique_ptr<BlobStore> store(new BlobStore(root, quota_bytes, durability, lock));
  // A file system without locks is served all the same.
  if (flock(lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    return absl::FailedPreconditionError(
        absl::StrCat("another bakewell-server uses ", root.string(), ": stop it, or name another --data"));
  }
  BAKEWELL_RETURN_IF_ERROR(MakeFolders(root, durability));
  return store;
}

BlobStore::~BlobStore() { close(lock_); }

fs::path BlobStore::PathOf(const Digest& digest) const {
  const std::string hex = digest.Hex();
  return durability_ == Durability::kScratch ? root_ / "blobs" / hex : root_ / "blobs" / hex.substr(0, 2) / hex;
}

absl::StatusOr<std::unique_ptr<BlobStore::Upload>> BlobStore::StartUpload(const Digest& digest, int64_t size_bytes) {
  if (size_bytes < 0) return absl::InvalidArgumentError("store: negative blob size");
  BAKEWELL_RETURN_IF_ERROR(CheckQuota(size_bytes));
  std::unique_ptr<Upload> upload(new Upload(*this, digest, size_bytes));
  upload->path_ = root_ / "incoming" / absl::StrCat(next_name_.fetch_add(1));
  upload->file_ = open(upload->path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (upload->file_ < 0) return FromErrno(errno, "creating a file in incoming");
  return upload;
}

absl::Status BlobStore::CheckQuota(int64_t more_bytes) const {
  const int64_t used = total_bytes() + incoming_bytes_.load(std::memory_order_relaxed);
  if (quota_bytes_ == 0 || more_bytes <= quota_bytes_ - used) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("store: ", used, " of ", quota_bytes_, " bytes used, ", more_bytes,
                                                   " more do not fit: collect garbage or raise the quota"));
}

BlobStore::Upload::~Upload() {
  if (file_ >= 0) close(file_);
  if (path_.empty()) return;
  store_.incoming_bytes_ -= size_bytes_;
  unlink(path_.c_str());
}

absl::Status BlobStore::Upload::Append(std::string_view bytes) {
  if (size_bytes_ + static_cast<int64_t>(bytes.size()) > declared_bytes_) {
    return absl::InvalidArgumentError(
        absl::StrCat("blob ", digest_.Hex(), ": more than the declared ", declared_bytes_, " bytes"));
  }
  BAKEWELL_RETURN_IF_ERROR(store_.CheckQuota(std::ssize(bytes)));
  hash_.Update(std::as_bytes(std::span(bytes)));
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t wrote = write(file_, bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return FromErrno(errno, absl::StrCat("writing blob ", digest_.Hex()));
    done += static_cast<size_t>(wrote);
  }
  size_bytes_ += std::ssize(bytes);
  store_.incoming_bytes_ += std::ssize(bytes);
  return absl::OkStatus();
}

absl::Status BlobStore::Upload::Finish() {
  if (hash_.Finish() != digest_) {
    return absl::DataLossError(
        absl::StrCat("blob ", digest_.Hex(), ": the ", size_bytes_, " bytes that came are not it; send it again"));
  }
  const bool safe = store_.durability_ == Durability::kSafe;
  if (safe && fsync(file_) != 0) return FromErrno(errno, absl::StrCat("syncing blob ", digest_.Hex()));
  const fs::path final_path = store_.PathOf(digest_);
  if (rename(path_.c_str(), final_path.c_str()) != 0) return FromErrno(errno, "moving a blob to its place");
  path_.clear();
  store_.incoming_bytes_ -= size_bytes_;
  if (safe) BAKEWELL_RETURN_IF_ERROR(SyncFolder(final_path.parent_path()));
  store_.Learn(digest_, size_bytes_);
  return absl::OkStatus();
}

absl::Status BlobStore::Put(const Digest& digest, std::string_view bytes) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto upload, StartUpload(digest, static_cast<int64_t>(bytes.size())));
  BAKEWELL_RETURN_IF_ERROR(upload->Append(bytes));
  return upload->Finish();
}

absl::StatusOr<std::unique_ptr<BlobStore::Download>> BlobStore::StartDownload(const Digest& digest) {
  std::unique_ptr<Download> download(new Download(*this, digest));
  download->size_bytes_ = SizeOf(digest);
  if (download->size_bytes_ < 0) return absl::NotFoundError(absl::StrCat("blob ", digest.Hex(), " is not stored"));
  download->file_ = open(PathOf(digest).c_str(), O_RDONLY | O_CLOEXEC);
  if (download->file_ < 0) {
    const absl::Status status = FromErrno(errno, absl::StrCat("opening blob ", digest.Hex()));
    if (absl::IsNotFound(status)) Quarantine(digest);
    return status;
  }
  return download;
}

BlobStore::Download::~Download() {
  if (file_ >= 0) close(file_);
}

absl::StatusOr<std::string> BlobStore::Download::Next(size_t max_bytes) {
  std::string bytes(max_bytes, '\0');
  ssize_t got = -1;
  do {
    got = read(file_, bytes.data(), bytes.size());
  } while (got < 0 && errno == EINTR);
  if (got < 0) return FromErrno(errno, absl::StrCat("reading blob ", digest_.Hex()));
  bytes.resize(static_cast<size_t>(got));
  hash_.Update(std::as_bytes(std::span(bytes)));
  return bytes;
}

absl::Status BlobStore::Download::Skip(int64_t offset) {
  if (offset < 0 || offset > size_bytes_) return absl::OutOfRangeError("offset is not inside the blob");
  while (offset > 0) {
    BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, Next(std::min<size_t>(kBlockBytes, offset)));
    if (bytes.empty()) break;  // shorter than it should be: Verify says so
    offset -= static_cast<int64_t>(bytes.size());
  }
  return absl::OkStatus();
}

absl::Status BlobStore::Download::Verify() {
  if (hash_.Finish() == digest_) return absl::OkStatus();
  store_.Quarantine(digest_);
  return absl::DataLossError(absl::StrCat("blob ", digest_.Hex(), ": corrupt on disk, moved to quarantine"));
}

absl::StatusOr<std::string> BlobStore::Get(const Digest& digest) {
  BAKEWELL_ASSIGN_OR_RETURN(const auto download, StartDownload(digest));
  std::string all;
  all.reserve(static_cast<size_t>(download->size_bytes()));
  for (;;) {
    BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, download->Next(kBlockBytes));
    if (bytes.empty()) break;
    all += bytes;
  }
  BAKEWELL_RETURN_IF_ERROR(download->Verify());
  return all;
}

absl::Status BlobStore::Link(const Digest& digest, const fs::path& path) const {
  if (link(PathOf(digest).c_str(), path.c_str()) == 0) return absl::OkStatus();
  return FromErrno(errno, absl::StrCat("linking blob ", digest.Hex()));
}

void BlobStore::Learn(const Digest& digest, int64_t size_bytes) {
  const std::lock_guard lock(mutex_);
  if (sizes_.try_emplace(digest, size_bytes).second) total_bytes_ += size_bytes;
}

void BlobStore::Forget(const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto found = sizes_.find(digest);
  if (found == sizes_.end()) return;
  total_bytes_ -= found->second;
  sizes_.erase(found);
}

bool BlobStore::Has(const Digest& digest) const { return SizeOf(digest) >= 0; }

int64_t BlobStore::SizeOf(const Digest& digest) const {
  const std::lock_guard lock(mutex_);
  const auto found = sizes_.find(digest);
  return found == sizes_.end() ? -1 : found->second;
}

size_t BlobStore::count() const {
  const std::lock_guard lock(mutex_);
  return sizes_.size();
}

absl::Status BlobStore::Remove(const Digest& digest) {
  Forget(digest);
  if (unlink(PathOf(digest).c_str()) == 0 || errno == ENOENT) return absl::OkStatus();
  return FromErrno(errno, absl::StrCat("deleting blob ", digest.Hex()));
}

void BlobStore::Quarantine(const Digest& digest) {
  Forget(digest);
  corrupt_.fetch_add(1, std::memory_order_relaxed);
  // Without a file to move there is nothing to keep; the blob is missing either way.
  std::error_code ignored;
  fs::rename(PathOf(digest), root_ / "quarantine" / digest.Hex(), ignored);
}

}  // namespace bakewell::store
