#include "core/artifact/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <thread>

#include "tests/support/temp_dir.h"

namespace bakewell {
namespace {

size_t FileCount(const std::filesystem::path& folder) {
  const std::filesystem::directory_iterator entries(folder);
  return static_cast<size_t>(std::distance(begin(entries), end(entries)));
}

TEST(WriteFileAtomically, ReplacesAndLeavesNoTemporary) {
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a", "one").ok());
  ASSERT_TRUE(WriteFileAtomically(folder / "a", "two").ok());
  EXPECT_EQ(ReadWholeFile(folder / "a").value(), "two");
  EXPECT_EQ(FileCount(folder.path()), 1u);
}

TEST(WriteFileAtomically, MissingFolderIsUnavailableAndNamesPathAndReason) {
  const absl::Status status = WriteFileAtomically("/nonexistent/a", "x");
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(std::string(status.message()).find("/nonexistent/"), std::string::npos);
  EXPECT_NE(std::string(status.message()).find("No such file or directory"), std::string::npos);
}

// EFBIG takes the way of ENOSPC and needs no full disk.
TEST(WriteFileAtomically, FullDiskIsResourceExhaustedAndLeavesTheOldFile) {
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "a", "old").ok());
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit tight = before;
  tight.rlim_cur = 1000;
  setrlimit(RLIMIT_FSIZE, &tight);
  const absl::Status status = WriteFileAtomically(folder / "a", std::string(5000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_EQ(ReadWholeFile(folder / "a").value(), "old");
  EXPECT_EQ(FileCount(folder.path()), 1u);
}

TEST(WriteFileAtomically, ConcurrentWritersLeaveOneOfTheirFilesWhole) {
  const TempDir folder;
  const std::string one(100000, '1'), two(100000, '2');
  const auto write = [&](const std::string& text) {
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(WriteFileAtomically(folder / "a", text).ok());
  };
  std::thread first(write, one), second(write, two);
  first.join();
  second.join();
  const std::string read = ReadWholeFile(folder / "a").value();
  EXPECT_TRUE(read == one || read == two);
  EXPECT_EQ(FileCount(folder.path()), 1u);
}

TEST(ReadWholeFile, MissingIsNotFoundAndAFolderIsInvalid) {
  EXPECT_EQ(ReadWholeFile("/nonexistent").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReadWholeFile("/tmp").status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace bakewell
