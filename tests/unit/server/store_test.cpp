#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>

#include "server/store/blobs.h"
#include "server/store/collect.h"
#include "server/store/database.h"
#include "server/store/writer.h"
#include "tests/support/temp_dir.h"

namespace bakewell::store {
namespace {

namespace fs = std::filesystem;

class StoreTest : public testing::Test {
 protected:
  void OpenAll() {
    auto database = OpenDatabase(dir.path() / "farm.db");
    ASSERT_TRUE(database.ok()) << database.status();
    writer = std::make_unique<Writer>(std::make_unique<Tables>(std::move(*database)));
    blobs.reset();
    auto opened = BlobStore::Open(dir.path(), 0);
    ASSERT_TRUE(opened.ok()) << opened.status();
    blobs = std::move(*opened);
  }
  Digest PutBlob(const std::string& bytes, int64_t touched_us = 1) {
    const Digest digest = Sha256Of(bytes);
    EXPECT_TRUE(blobs->Put(digest, bytes).ok());
    EXPECT_TRUE(writer
                    ->Run([&](Tables& tables) {
                      return tables.InsertBlob({digest, static_cast<int64_t>(bytes.size()), 0, touched_us});
                    })
                    .ok());
    return digest;
  }
  void Know(const TaskKey& key, const std::string& bytes, int64_t used_us) {
    const TaskOutputs outputs = {{"out", PutBlob(bytes), static_cast<int64_t>(bytes.size())}};
    EXPECT_TRUE(writer->Run([&](Tables& tables) { return tables.InsertKnown(key, {outputs, 5, used_us}); }).ok());
  }
  static TaskKey Key(const std::string& name) { return TaskKey{Sha256Of(name)}; }
  fs::path FileOf(const Digest& digest) { return dir.path() / "blobs" / digest.Hex().substr(0, 2) / digest.Hex(); }

  TempDir dir;
  std::unique_ptr<Writer> writer;
  std::unique_ptr<BlobStore> blobs;
  CollectGate gate;
};

// Symptom: two servers on one folder, on different ports, deleted each other's uploads and leased the same tasks.
TEST_F(StoreTest, FolderHasOneServerAtATime) {
  auto one = BlobStore::Open(dir.path(), 0);
  ASSERT_TRUE(one.ok()) << one.status();
  EXPECT_TRUE(absl::IsFailedPrecondition(BlobStore::Open(dir.path(), 0).status()));
  one->reset();
  EXPECT_TRUE(BlobStore::Open(dir.path(), 0).ok());
}

// Symptom: uploads at a time were held against the quota one by one, and went above it together.
TEST_F(StoreTest, UploadsAtATimeKeepTheQuotaTogether) {
  const auto quota = BlobStore::Open(dir.path(), 1000).value();
  const std::string bytes(600, 'x');
  const auto one = quota->StartUpload(Sha256Of(bytes), 600), other = quota->StartUpload(Sha256Of(bytes), 600);
  ASSERT_TRUE(one.ok() && other.ok()) << "nothing has come yet";
  EXPECT_TRUE((*one)->Append(bytes).ok());
  EXPECT_TRUE(absl::IsResourceExhausted((*other)->Append(bytes)));
  EXPECT_TRUE(absl::IsResourceExhausted(quota->StartUpload(Sha256Of("y"), 401).status()));
  EXPECT_TRUE((*one)->Finish().ok());
  EXPECT_EQ(quota->total_bytes(), 600);
  EXPECT_TRUE(quota->Put(Sha256Of(std::string(400, 'z')), std::string(400, 'z')).ok()) << "what failed counts no more";
}

TEST_F(StoreTest, NewerDatabaseIsRefusedAndUntouched) {
  OpenAll();
  writer.reset();
  SQLite::Database(dir.path() / "farm.db", SQLite::OPEN_READWRITE).exec("PRAGMA user_version=99");
  EXPECT_EQ(OpenDatabase(dir.path() / "farm.db").status().code(), absl::StatusCode::kFailedPrecondition);
  SQLite::Database after(dir.path() / "farm.db");
  EXPECT_EQ(after.execAndGet("PRAGMA user_version").getInt(), 99);
}

TEST_F(StoreTest, DatabaseOfTheFirstSchemaIsMigratedWithItsRows) {
  {
    std::ifstream file(std::string(BAKEWELL_SOURCE_DIR) + "/schema/0001_farm.sql");
    const std::string sql(std::istreambuf_iterator<char>(file), {});
    SQLite::Database old(dir.path() / "farm.db", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    old.exec(sql);
    old.exec(
        "INSERT INTO job(user,client_key,name,state,priority,scene,settings,submitted_us,reason) "
        "VALUES('ann','key','level',2,0,x'','',5,'it burnt')");
    old.exec("PRAGMA user_version=1");
  }
  OpenAll();
  std::optional<JobRow> job;
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) {
                    job = *tables.FindJob(1);
                    return absl::OkStatus();
                  })
                  .ok());
  ASSERT_TRUE(job.has_value());
  EXPECT_EQ(job->reason, "it burnt");
  EXPECT_EQ(job->code, 0);
  EXPECT_TRUE(job->phases.empty());
}

TEST_F(StoreTest, ForeignFileIsNotADatabase) {
  std::ofstream(dir.path() / "farm.db") << std::string(8192, 'x');
  EXPECT_EQ(OpenDatabase(dir.path() / "farm.db").status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(StoreTest, CommittedRowsSurviveReopening) {
  OpenAll();
  Know(Key("a"), "bytes", 7);
  writer.reset();
  OpenAll();
  std::optional<KnownTask> known;
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) {
                    known = *tables.FindKnown(Key("a"));
                    return absl::OkStatus();
                  })
                  .ok());
  ASSERT_TRUE(known.has_value());
  EXPECT_EQ(known->outputs[0].digest, Sha256Of("bytes"));
}

TEST_F(StoreTest, ManyWorksShareOneCommit) {
  OpenAll();
  std::atomic<int> done{0};
  for (int i = 0; i < 1000; ++i) {
    writer->Submit(
        [i](Tables& tables) {
          return tables.InsertKnown(Key(std::to_string(i)), {{}, 1, 1});
        },
        [&](const absl::Status& status) { done += status.ok(); });
  }
  ASSERT_TRUE(writer->Run([](Tables&) { return absl::OkStatus(); }).ok());
  EXPECT_EQ(done, 1000);
  EXPECT_LT(writer->commits(), 500u);
}

TEST_F(StoreTest, FailedWorkIsUndoneAlone) {
  OpenAll();
  absl::Status bad;
  writer->Submit([](Tables& tables) { return tables.InsertKnown(Key("before"), {{}, 1, 1}); });
  writer->Submit(
      [](Tables& tables) {
        tables.InsertKnown(Key("undone"), {{}, 1, 1}).IgnoreError();
        return absl::InternalError("no");
      },
      [&](const absl::Status& status) { bad = status; });
  ASSERT_TRUE(writer
                  ->Run([](Tables& tables) -> absl::Status {
                    EXPECT_TRUE((*tables.FindKnown(Key("before"))).has_value());
                    EXPECT_FALSE((*tables.FindKnown(Key("undone"))).has_value());
                    return absl::OkStatus();
                  })
                  .ok());
  EXPECT_FALSE(bad.ok());
}

TEST_F(StoreTest, JobRoundTripAndIdempotentKey) {
  OpenAll();
  JobRow job{0, "ann", "key1", "level", JobState::kRunning, 100, Sha256Of("scene"), "set", 12, 0, "", 5, 2,
             0, "",    0,      ""};
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) -> absl::Status {
                    BAKEWELL_ASSIGN_OR_RETURN(job.id, tables.InsertJob(job));
                    EXPECT_EQ(
                        tables.InsertJob(JobRow{0, "ann", "key1", "", {}, 0, {}, "", 0, 0, "", 0, 0, 0, "", 0, ""})
                            .status()
                            .code(),
                        absl::StatusCode::kAlreadyExists);
                    job.state = JobState::kDone;
                    job.finished_us = 99;
                    BAKEWELL_RETURN_IF_ERROR(tables.UpdateJob(job));
                    const auto found = *tables.FindJobByKey("ann", "key1");
                    EXPECT_EQ(found->id, job.id);
                    EXPECT_EQ(found->state, JobState::kDone);
                    EXPECT_EQ(found->scene, Sha256Of("scene"));
                    EXPECT_EQ(tables.ListJobs({"ann", JobState::kDone, INT64_MAX, 10})->size(), 1u);
                    EXPECT_EQ(tables.ListJobs({"bob", {}, INT64_MAX, 10})->size(), 0u);
                    return absl::OkStatus();
                  })
                  .ok());
}

TEST_F(StoreTest, EpochRises) {
  OpenAll();
  int64_t first = 0, second = 0;
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) {
                    first = *tables.NextEpoch();
                    return absl::OkStatus();
                  })
                  .ok());
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) {
                    second = *tables.NextEpoch();
                    return absl::OkStatus();
                  })
                  .ok());
  EXPECT_EQ(second, first + 1);
}

TEST_F(StoreTest, BackupOfALiveDatabaseHoldsWhatWasCommitted) {
  OpenAll();
  Know(Key("a"), "bytes", 7);
  ASSERT_TRUE(BackupDatabase(dir.path() / "farm.db", dir.path() / "copy.db").ok());
  EXPECT_EQ(BackupDatabase(dir.path() / "farm.db", dir.path() / "copy.db").code(), absl::StatusCode::kAlreadyExists);
  Tables copy(*OpenReadOnly(dir.path() / "copy.db"));
  EXPECT_TRUE((*copy.FindKnown(Key("a"))).has_value());
}

TEST_F(StoreTest, TokensAreFoundByHashOnly) {
  OpenAll();
  ASSERT_TRUE(writer
                  ->Run([&](Tables& tables) -> absl::Status {
                    BAKEWELL_RETURN_IF_ERROR(tables.PutToken({Sha256Of("secret"), "ann", 5, 1, 0}));
                    EXPECT_EQ((*tables.FindToken(Sha256Of("secret")))->user, "ann");
                    EXPECT_FALSE((*tables.FindToken(Sha256Of("guess"))).has_value());
                    BAKEWELL_RETURN_IF_ERROR(tables.DeleteTokensOf("ann"));
                    EXPECT_EQ(*tables.CountTokens(), 0);
                    return absl::OkStatus();
                  })
                  .ok());
}

TEST_F(StoreTest, BlobComesBackAndWrongBytesAreRefused) {
  OpenAll();
  const Digest digest = PutBlob("hello");
  EXPECT_EQ(*blobs->Get(digest), "hello");
  EXPECT_EQ(blobs->Put(Sha256Of("x"), "y").code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(blobs->Has(Sha256Of("x")));
  EXPECT_TRUE(fs::is_empty(dir.path() / "incoming"));
}

TEST_F(StoreTest, LinkedBlobOutlivesItsOwn) {
  OpenAll();
  const fs::path path = dir.path() / "linked";
  EXPECT_EQ(blobs->Link(Sha256Of("hello"), path).code(), absl::StatusCode::kNotFound);
  const Digest digest = PutBlob("hello");
  ASSERT_TRUE(blobs->Link(digest, path).ok());
  ASSERT_TRUE(blobs->Remove(digest).ok());
  std::string bytes;
  std::ifstream(path) >> bytes;
  EXPECT_EQ(bytes, "hello");
}

TEST_F(StoreTest, LinkedBlobToAnotherFileSystemIsRefusedAndStays) {
  const TempDir memory("/dev/shm"), disk;
  const TempDir& elsewhere = OnOneFileSystem(memory, dir) ? disk : memory;
  if (OnOneFileSystem(elsewhere, dir)) GTEST_SKIP() << "/dev/shm and the folder for files that pass are one";
  OpenAll();
  const Digest digest = PutBlob("hello");
  EXPECT_EQ(blobs->Link(digest, elsewhere / "linked").code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(fs::is_empty(elsewhere.path()));
  EXPECT_EQ(blobs->Get(digest).value(), "hello");
}

TEST_F(StoreTest, MoreBytesThanDeclaredAreRefused) {
  OpenAll();
  const auto upload = blobs->StartUpload(Sha256Of("abc"), 2);
  ASSERT_TRUE(upload.ok());
  EXPECT_EQ((*upload)->Append("abc").code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(StoreTest, AbandonedUploadLeavesNothing) {
  OpenAll();
  { EXPECT_TRUE((*blobs->StartUpload(Sha256Of("abc"), 3))->Append("a").ok()); }
  EXPECT_TRUE(fs::is_empty(dir.path() / "incoming"));
  std::ofstream(dir.path() / "incoming" / "left_by_a_crash") << "x";
  OpenAll();
  EXPECT_TRUE(fs::is_empty(dir.path() / "incoming"));
}

TEST_F(StoreTest, CorruptBlobIsQuarantinedAndMissing) {
  OpenAll();
  const Digest digest = PutBlob("hello");
  std::ofstream(FileOf(digest)) << "jello";
  EXPECT_EQ(blobs->Get(digest).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(blobs->Has(digest));
  EXPECT_TRUE(fs::exists(dir.path() / "quarantine" / digest.Hex()));
  PutBlob("hello");
  EXPECT_EQ(*blobs->Get(digest), "hello");
}

TEST_F(StoreTest, VanishedBlobIsMissing) {
  OpenAll();
  const Digest digest = PutBlob("hello");
  fs::remove(FileOf(digest));
  EXPECT_EQ(blobs->Get(digest).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(blobs->Has(digest));
}

TEST_F(StoreTest, ResumedDownloadIsVerifiedAsAWhole) {
  OpenAll();
  const Digest digest = PutBlob("hello world");
  const auto download = blobs->StartDownload(digest);
  ASSERT_TRUE((*download)->Skip(6).ok());
  EXPECT_EQ(*(*download)->Next(100), "world");
  EXPECT_TRUE((*download)->Verify().ok());
  EXPECT_EQ((*blobs->StartDownload(digest))->Skip(12).code(), absl::StatusCode::kOutOfRange);
}

TEST_F(StoreTest, QuotaIsKept) {
  OpenAll();
  blobs.reset();
  blobs = BlobStore::Open(dir.path(), 8).value();
  EXPECT_TRUE(blobs->Put(Sha256Of("12345"), "12345").ok());
  EXPECT_EQ(blobs->Put(Sha256Of("6789"), "6789").code(), absl::StatusCode::kResourceExhausted);
}

TEST_F(StoreTest, CollectionGivesUpTheOldestAndKeepsWhatIsNeeded) {
  OpenAll();
  Know(Key("oldest needed"), "aaaa", 1);
  Know(Key("old"), "bbbb", 2);
  Know(Key("new"), "cccc", 3);
  Know(Key("shares"), "cccc", 4);
  const Digest loose = PutBlob("dddd", 1), fresh = PutBlob("eeee", 1000);
  const CollectOptions options{16, 2000, 1500};
  const auto report =
      Collect(*writer, *blobs, gate, options, [](const TaskKey& key) { return key == Key("oldest needed"); });
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_FALSE(blobs->Has(loose));
  EXPECT_TRUE(blobs->Has(fresh));
  EXPECT_TRUE(blobs->Has(Sha256Of("aaaa")));
  EXPECT_EQ(report->bytes, 20 - blobs->total_bytes());
}

// Symptom: with a target that recent results alone exceed, every result was forgotten and no byte won.
TEST_F(StoreTest, CollectionForgetsNoResultWhoseBlobsStay) {
  OpenAll();
  const TaskOutputs outputs = {{"out", PutBlob("bbbb", 1000), 4}};
  Know(Key("old"), "aaaa", 100);
  EXPECT_TRUE(writer->Run([&](Tables& tables) { return tables.InsertKnown(Key("new"), {outputs, 5, 1000}); }).ok());
  const auto report = Collect(*writer, *blobs, gate, {0, 2000, 1500}, [](const TaskKey&) { return false; });
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->results, 1);
  EXPECT_TRUE(blobs->Has(Sha256Of("bbbb")));
}

// A hold that began on one thread may end on another.
TEST_F(StoreTest, CollectionWaitsForThoseWhoPlan) {
  OpenAll();
  const Digest loose = PutBlob("dddd", 1);
  CollectGate::Hold hold = gate.Enter();
  std::thread planner([&, hold = std::move(hold)]() mutable {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    EXPECT_TRUE(blobs->Has(loose));
    hold.reset();
  });
  EXPECT_TRUE(Collect(*writer, *blobs, gate, {0, 2000, 1}, [](const TaskKey&) { return false; }).ok());
  EXPECT_FALSE(blobs->Has(loose));
  planner.join();
}

TEST_F(StoreTest, BlobStaysWhileOneOfTwoResultsNamesIt) {
  OpenAll();
  Know(Key("a"), "same", 1);
  Know(Key("b"), "same", 2);
  ASSERT_TRUE(writer->Run([](Tables& tables) { return tables.DeleteKnown(Key("a")); }).ok());
  ASSERT_TRUE(Collect(*writer, *blobs, gate, {1 << 20, 10'000'000'000, 1}, [](const TaskKey&) { return false; }).ok());
  EXPECT_TRUE(blobs->Has(Sha256Of("same")));
  ASSERT_TRUE(writer->Run([](Tables& tables) { return tables.DeleteKnown(Key("b")); }).ok());
  ASSERT_TRUE(Collect(*writer, *blobs, gate, {1 << 20, 10'000'000'000, 1}, [](const TaskKey&) { return false; }).ok());
  EXPECT_FALSE(blobs->Has(Sha256Of("same")));
}

}  // namespace
}  // namespace bakewell::store
