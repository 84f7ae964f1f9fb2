#include "core/artifact/output_dir.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "core/artifact/atomic_file.h"
#include "tests/support/temp_dir.h"

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
  const TempDir folder;
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
  const TempDir folder;
  {
    absl::StatusOr<OutputDir> out = OutputDir::Create(folder / "a/b/");
    ASSERT_TRUE(out.ok()) << out.status();
    ASSERT_TRUE(WriteFileAtomically(out->Staging() / "x.exr", "x").ok());
    const OutputDir moved = *std::move(out);  // the moved-from one must not clean up
  }
  EXPECT_TRUE(Names(folder.path()).empty());
}

TEST(OutputDir, AnEarlierBakeStaysUntilCommitAndIsReplacedByIt) {
  const TempDir folder;
  for (const char* const name : {"x.exr", "manifest.json", "mine.txt"}) {
    ASSERT_TRUE(WriteFileAtomically(folder / name, "old").ok());
  }
  { ASSERT_TRUE(OutputDir::Create(folder.path()).ok()); }
  EXPECT_EQ(Names(folder.path()), (std::vector<std::string>{"manifest.json", "mine.txt", "x.exr"}));
  absl::StatusOr<OutputDir> out = OutputDir::Create(folder.path());
  ASSERT_TRUE(WriteFileAtomically(out->Staging() / "x.exr", "new").ok());
  ASSERT_TRUE(out->Commit().ok());
  EXPECT_EQ(ReadWholeFile(folder / "x.exr").value(), "new");
  EXPECT_EQ(ReadWholeFile(folder / "mine.txt").value(), "old");
  EXPECT_FALSE(fs::exists(folder / "manifest.json")) << "it described the files that were replaced";
}

// Symptom: after a second Ctrl-C the next bake left the killed one's folder where it was, for it was not a minute old.
TEST(OutputDir, StagingOfAKilledProcessIsRemovedThatOfALivingOneIsNot) {
  const TempDir folder;
  const absl::StatusOr<OutputDir> living = OutputDir::Create(folder.path());
  ASSERT_TRUE(living.ok());
  fs::create_directories(folder / ".bakewell-killed" / "farm");
  fs::last_write_time(living->Staging(), fs::file_time_type::clock::now() - std::chrono::hours(1));
  ASSERT_TRUE(OutputDir::Create(folder.path()).ok());
  EXPECT_FALSE(fs::exists(folder / ".bakewell-killed"));
  EXPECT_TRUE(fs::exists(living->Staging()));
}

TEST(OutputDir, ManyBakesAtATimeDoNotTakeEachOthersStaging) {
  const TempDir folder;
  std::atomic<int> kept{0};
  std::vector<std::thread> bakes;
  for (int i = 0; i < 8; ++i) {
    bakes.emplace_back([&] {
      for (int round = 0; round < 50; ++round) {
        const absl::StatusOr<OutputDir> out = OutputDir::Create(folder.path());
        std::this_thread::yield();
        kept += out.ok() && fs::exists(out->Staging());
      }
    });
  }
  for (std::thread& bake : bakes) bake.join();
  EXPECT_EQ(kept, 8 * 50);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(OutputDir, AFileInTheWayIsTheUsersError) {
  const TempDir folder;
  ASSERT_TRUE(WriteFileAtomically(folder / "out", "x").ok());
  EXPECT_EQ(OutputDir::Create(folder / "out").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_FALSE(OutputDir::Create(folder / "out/deeper").ok());
}

}  // namespace
}  // namespace bakewell
