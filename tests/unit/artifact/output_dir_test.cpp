#include "core/artifact/output_dir.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/artifact/atomic_file.h"
#include "tests/support/temp_folder.h"

namespace bakewell {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Names(const fs::path& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(OutputDir, FilesAppearAtCommitAndNothingElseStays) {
  const TempFolder folder;
  {
    absl::StatusOr<OutputDir> out = OutputDir::Create(folder / "a/b");
    ASSERT_TRUE(out.ok()) << out.status();
    ASSERT_TRUE(WriteFileAtomically(out->Staging() / "x.exr", "x").ok());
    ASSERT_TRUE(WriteFileAtomically(out->Staging() / "manifest.json", "{}").ok());
    EXPECT_FALSE(fs::exists(folder / "a/b/x.exr"));
    const absl::StatusOr<std::vector<fs::path>> files = out->Commit();
    ASSERT_TRUE(files.ok()) << files.status();
    EXPECT_EQ(*files, (std::vector<fs::path>{folder / "a/b/manifest.json", folder / "a/b/x.exr"}));
  }
  EXPECT_EQ(Names(folder / "a/b"), (std::vector<std::string>{"manifest.json", "x.exr"}));
}

TEST(OutputDir, WithoutCommitTheDiskIsAsBefore) {
  const TempFolder folder;
  {
    absl::StatusOr<OutputDir> out = OutputDir::Create(folder / "a/b/");
    ASSERT_TRUE(out.ok()) << out.status();
    ASSERT_TRUE(WriteFileAtomically(out->Staging() / "x.exr", "x").ok());
    const OutputDir moved = *std::move(out);  // the moved-from one must not clean up
  }
  EXPECT_TRUE(Names(folder.Path()).empty());
}

TEST(OutputDir, AnEarlierBakeStaysUntilCommitAndIsReplacedByIt) {
  const TempFolder folder;
  for (const char* const name : {"x.exr", "manifest.json", "mine.txt"}) {
    ASSERT_TRUE(WriteFileAtomically(folder / name, "old").ok());
  }
  { ASSERT_TRUE(OutputDir::Create(folder.Path()).ok()); }
  EXPECT_EQ(Names(folder.Path()), (std::vector<std::string>{"manifest.json", "mine.txt", "x.exr"}));
  absl::StatusOr<OutputDir> out = OutputDir::Create(folder.Path());
  ASSERT_TRUE(WriteFileAtomically(out->Staging() / "x.exr", "new").ok());
  ASSERT_TRUE(out->Commit().ok());
  EXPECT_EQ(ReadWholeFile(folder / "x.exr").value(), "new");
  EXPECT_EQ(ReadWholeFile(folder / "mine.txt").value(), "old");
  EXPECT_FALSE(fs::exists(folder / "manifest.json")) << "it described the files that were replaced";
}

TEST(OutputDir, StagingOfAKilledProcessIsRemovedThatOfALivingOneIsNot) {
  const TempFolder folder;
  const absl::StatusOr<OutputDir> living = OutputDir::Create(folder.Path());
  ASSERT_TRUE(living.ok());
  fs::create_directory(folder / ".bakewell-killed");
  for (const fs::path& path : {folder / ".bakewell-killed", living->Staging()}) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(1));
  }
  ASSERT_TRUE(OutputDir::Create(folder.Path()).ok());
  EXPECT_FALSE(fs::exists(folder / ".bakewell-killed"));
  EXPECT_TRUE(fs::exists(living->Staging()));
}

TEST(OutputDir, AFileInTheWayIsTheUsersError) {
  const TempFolder folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "out", "x").ok());
  EXPECT_EQ(OutputDir::Create(folder / "out").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(OutputDir::Create(folder / "out/deeper").ok());
}

}  // namespace
}  // namespace bakewell
