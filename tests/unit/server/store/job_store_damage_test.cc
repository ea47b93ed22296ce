// Stores that are damaged, or that another version made.
#include <filesystem>

#include "absl/strings/str_cat.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {
namespace {

using testing::ElementsAre;

// The tables as version 1 made them.
constexpr char kSchemaOfVersion1[] = R"(
  CREATE TABLE jobs(
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    job_id BLOB NOT NULL UNIQUE,
    owner BLOB NOT NULL,
    request_id BLOB NOT NULL,
    client BLOB NOT NULL,
    scan BLOB NOT NULL,
    surface BLOB NOT NULL,
    end_ms INTEGER NOT NULL,
    header BLOB NOT NULL,
    job BLOB NOT NULL,
    UNIQUE(owner, request_id));
  CREATE INDEX jobs_by_end ON jobs(end_ms, number))";

constexpr char kScansOfVersion2[] = R"(;
  CREATE TABLE scans(owner BLOB NOT NULL, scan BLOB NOT NULL, PRIMARY KEY(owner, scan)) WITHOUT ROWID;
  CREATE INDEX scans_by_name ON scans(scan))";

TEST_F(FolderStoreTest, StoresOfEarlierVersionsGoOn) {
  for (const int version : {1, 2}) {
    StoredJob waiting = NewJob("a", "ann"), done = Finished(NewJob("b", "ann"));
    waiting.header.mutable_options()->mutable_control()->mutable_control_mesh()->set_positions(
        std::string(50'000, 'm'));
    const std::string scan = waiting.job.scan_id(), file = test_ / "store/jobs.db";
    done.surface = Blob(9, 70);
    store_.reset();
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file + end);
    {
      auto old = *SqliteDatabase::Open(file);
      const std::string schema =
          absl::StrCat(kSchemaOfVersion1, version == 2 ? kScansOfVersion2 : "");
      ASSERT_TRUE(old.Make(version, schema.c_str()).ok());
      for (const StoredJob& job : {waiting, done}) {
        auto insert = *old.Prepare(
            "INSERT INTO jobs(job_id, owner, request_id, client, scan, surface, end_ms, header, "
            "job)"
            " VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)");
        insert.Bind(job.job.job_id()).Bind("ann").Bind(job.job.request_id()).Bind("c").Bind(scan);
        insert.Bind(job.surface).Bind(job.surface.empty() ? int64_t{0} : wall_ - 1000);
        insert.Bind(job.header.SerializeAsString()).Bind(job.job.SerializeAsString());
        ASSERT_TRUE(insert.Run().ok());
      }
      if (version == 2) {
        auto scans = *old.Prepare("INSERT INTO scans VALUES(?, ?)");
        ASSERT_TRUE(scans.Bind("ann").Bind(scan).Run().ok());
      }
    }
    Reopen();
    const auto kept = store_->Get("ann", "a");
    ASSERT_TRUE(kept.ok()) << kept.status();
    EXPECT_EQ(kept->job.request_id(), "r-a");
    EXPECT_EQ(kept->header.point_count(), 20u);
    EXPECT_FALSE(kept->mesh.empty());
    EXPECT_TRUE(store_->blobs().Read(kept->mesh).ok());
    EXPECT_EQ(store_->Unfinished()->size(), 1u);
    EXPECT_EQ(store_->Get("ann", "b")->surface, done.surface);
    EXPECT_TRUE(store_->BytesOfScan("ann", scan).ok()) << "who has a job of it";
    EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("bob", scan).status()));
    EXPECT_FALSE(std::filesystem::exists(file + ".old"));
    EXPECT_LT(std::filesystem::file_size(file), 200'000u);
    EXPECT_THAT(Counts(), testing::HasSubstr("ann: "));
    EXPECT_EQ(*SqliteDatabase::Open(file)->Version(), kSchemaVersion);
    ASSERT_TRUE(SqliteDatabase::Open(file)->Execute("DELETE FROM jobs").ok());
    Reopen();
  }
}

TEST_F(FolderStoreTest, AStoreOfALaterVersionIsRefused) {
  Tamper("PRAGMA user_version = 99");
  EXPECT_EQ(JobStore::Open(test_ / "store").status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(FolderStoreTest, AnEmptyDatabaseBesideBlobsIsRefused) {
  Blob(1);
  store_.reset();
  std::filesystem::resize_file(test_ / "store/jobs.db", 0);
  const absl::Status lost = JobStore::Open(test_ / "store").status();
  EXPECT_TRUE(absl::IsDataLoss(lost)) << lost;
  EXPECT_THAT(std::string(lost.message()), testing::HasSubstr("--repair"));
  std::filesystem::remove(test_ / "store/jobs.db");
  EXPECT_TRUE(absl::IsDataLoss(JobStore::Open(test_ / "store").status()));
}

// All rows can be read, but not found.
TEST_F(FolderStoreTest, ADamagedIndexIsNoticedAtTheStart) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  Tamper(
      "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE INDEX jobs_by_end ON "
      "jobs(header)' WHERE name = 'jobs_by_end'");
  store_.reset();
  const absl::Status damaged = JobStore::Open(test_ / "store").status();
  EXPECT_TRUE(absl::IsDataLoss(damaged)) << damaged;
  EXPECT_THAT(std::string(damaged.message()), testing::HasSubstr("--repair"));
}

TEST_F(FolderStoreTest, ADamagedRowIsSetAside) {
  for (const auto* id : {"a", "b", "c"}) ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
  Tamper("UPDATE jobs SET job = x'ff' WHERE job_id = x'62'");
  Reopen();
  EXPECT_EQ(store_->Unfinished()->size(), 2u) << "the others are worked on";
  ASSERT_EQ(reports_.size(), 1u);
  EXPECT_THAT(reports_[0], testing::HasSubstr("job b"));
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("", 10, &before)), ElementsAre("c", "a"));
  EXPECT_TRUE(absl::IsDataLoss(store_->Get("", "b").status()));
  EXPECT_TRUE(absl::IsNotFound(store_->Get("ann", "b").status()));
  EXPECT_TRUE(store_->Insert(NewJob("b")).ok()) << "it can be created again";
  Counts();
  Reopen();
  EXPECT_TRUE(store_->Remove("", "b").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "b").status()));
}

// Whatever is changed in a row is noticed, also what still parses.
TEST_F(FolderStoreTest, AChangedRowIsDamaged) {
  StoredJob job = NewJob("a");
  ASSERT_TRUE(store_->Insert(job).ok());
  job = Finished(job);
  job.job.mutable_surface()->add_chunk_bytes(3);
  job.job.mutable_surface()->set_total_bytes(3);
  ASSERT_TRUE(store_->Finish(job, {{1, 2, 3}}).ok());
  for (const char* change : {"header = x''", "surface = x''", "owner = x'61'",
                             "end_ms = end_ms + 1", "unclean_ends = 1"}) {
    Tamper(absl::StrCat("CREATE TABLE kept AS SELECT * FROM jobs; UPDATE jobs SET ", change));
    Reopen();
    EXPECT_TRUE(store_->Get("", "a").status().code() != absl::StatusCode::kOk) << change;
    Tamper("INSERT OR REPLACE INTO jobs SELECT * FROM kept; DROP TABLE kept; DELETE FROM damaged");
  }
  Reopen();
  EXPECT_TRUE(store_->Get("", "a").ok());
}

TEST_F(FolderStoreTest, AScanThatIsCutIsForgotten) {
  const std::string scan = Scan(4, "ann");
  std::filesystem::resize_file(test_ / "store/blobs/" + scan, 5);
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
  EXPECT_EQ(Scan(4, "ann"), scan) << "sent again";
  EXPECT_TRUE(store_->BytesOfScan("ann", scan).ok());
  ASSERT_TRUE(store_->SetScanAside(scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->BytesOfScan("ann", scan).status()));
  EXPECT_TRUE(std::filesystem::exists(test_ / "store/damaged/" + scan));
}

TEST_F(FolderStoreTest, AFolderHasOneServer) {
  EXPECT_EQ(JobStore::Open(test_ / "store").status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
