#include "server/store/job_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using testing::ElementsAre;

class JobStoreTest : public testing::Test {
 protected:
  JobStoreTest() {
    settings_.clock = {.wall_ms = [this] { return wall_; },
                       .steady_ms = [this] { return steady_; }};
    settings_.report = [this](const std::string& line) { reports_.push_back(line); };
    Reopen();
  }

  void Reopen(const Retention& retention) {
    settings_.retention = retention;
    Reopen();
  }

  // Both clocks, as time passes.
  void Pass(int64_t ms) {
    wall_ += ms;
    steady_ += ms;
  }

  // A statement on the database while no store has it.
  void Tamper(const std::string& sql) {
    store_.reset();
    ASSERT_TRUE(Database::Open(test_ / "store/jobs.db")->Execute(sql).ok());
  }

  // Counts of uses and bytes by owner, to be the same as when they are counted anew.
  std::string Counts() {
    store_.reset();
    JobTables tables(*Database::Open(test_ / "store/jobs.db"));
    std::string text[2];
    for (std::string& now : text) {
      auto uses = *tables.database().Prepare("SELECT blob, owner, count FROM uses ORDER BY 1, 2");
      while (*uses.Step()) {
        absl::StrAppend(&now, uses.Bytes(0), " ", uses.Bytes(1), " ", uses.Integer(2), "\n");
      }
      const auto owners = *tables.Owners();
      for (const auto& [owner, bytes] : owners) {
        if (bytes != 0) absl::StrAppend(&now, owner, ": ", bytes, "\n");
      }
      EXPECT_TRUE(tables.Recount().ok());
    }
    EXPECT_EQ(text[0], text[1]);
    return text[1];
  }

  void Reopen() {
    store_.reset();
    auto opened = JobStore::Open(test_ / "store", settings_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  std::string Blob(uint8_t value, size_t size = 10) {
    return *store_->blobs().Put({std::vector<uint8_t>(size, value)});
  }

  std::string Scan(uint8_t value, const std::string& owner = "") {
    const std::string scan = Blob(value);
    EXPECT_TRUE(store_->AddScan(owner, scan).ok());
    return scan;
  }

  StoredJob NewJob(const std::string& id, const std::string& owner = "") {
    StoredJob stored;
    stored.owner = owner;
    stored.client = "c";
    stored.header.set_point_count(20);
    stored.job.set_job_id(id);
    stored.job.set_request_id("r-" + id);
    stored.job.set_scan_id(Scan(1, owner));
    stored.job.set_state(v1::JOB_STATE_QUEUED);
    return stored;
  }

  static StoredJob Finished(StoredJob stored) {
    stored.job.set_state(v1::JOB_STATE_SUCCEEDED);
    return stored;
  }

  static std::vector<std::string> Ids(const std::vector<v1::Job>& jobs) {
    std::vector<std::string> ids;
    for (const auto& job : jobs) ids.push_back(job.job_id());
    return ids;
  }

  static constexpr int64_t kDay = 24 * 3'600'000;

  TestFolder test_;
  int64_t wall_ = 1'700'000'000'000, steady_ = 5'000;
  std::vector<std::string> reports_;
  StoreSettings settings_;
  std::unique_ptr<JobStore> store_;
};

TEST_F(JobStoreTest, JobsOutliveTheStore) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Insert(NewJob("b")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("a")), {{2}}).ok());
  Reopen();
  const auto a = store_->Get("", "a");
  ASSERT_TRUE(a.ok()) << a.status();
  EXPECT_EQ(a->job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(a->surface, ContentNameOf("\x02"));
  EXPECT_EQ(a->client, "c");
  EXPECT_EQ(a->header.point_count(), 20u);
  const auto unfinished = store_->Unfinished();
  ASSERT_EQ(unfinished->size(), 1u);
  EXPECT_EQ(unfinished->front().job.job_id(), "b");
}

TEST_F(JobStoreTest, TheSameRequestAtOnceMakesOneJob) {
  std::vector<std::string> ids(16);
  {
    const StoredJob original = NewJob("x");
    std::vector<std::jthread> threads;
    for (int i = 0; i < 16; ++i) {
      threads.emplace_back([&, i] {
        StoredJob mine = original;
        mine.job.set_job_id(absl::StrCat("j", i));
        ids[static_cast<size_t>(i)] = store_->Insert(mine)->job.job_id();
      });
    }
  }
  int64_t before = 0;
  EXPECT_EQ(store_->List("", 100, &before)->size(), 1u);
  for (const auto& id : ids) EXPECT_EQ(id, ids[0]);
  StoredJob others = NewJob("x", "somebody else");
  EXPECT_EQ(store_->Insert(others)->job.job_id(), "x") << "request ids are each owner's own";
}

TEST_F(JobStoreTest, AJobNeedsItsScan) {
  StoredJob job = NewJob("a");
  job.job.set_scan_id(ContentNameOf("nothing"));
  EXPECT_EQ(store_->Insert(job).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(JobStoreTest, AScanIsOfThoseWhoSentIt) {
  StoredJob job = NewJob("a", "ann");
  const std::string scan = job.job.scan_id();
  EXPECT_TRUE(store_->ReadScan("ann", scan).ok());
  const absl::Status to_bob = store_->ReadScan("bob", scan).status();
  EXPECT_TRUE(absl::IsNotFound(to_bob));
  EXPECT_EQ(to_bob, store_->ReadScan("bob", ContentNameOf("nothing")).status())
      << "nothing tells that there is one";
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", Blob(7)).status())) << "no scan: a surface";
  job.owner = "bob";
  EXPECT_TRUE(absl::IsNotFound(store_->Insert(job).status()));
  ASSERT_TRUE(store_->AddScan("bob", scan).ok());
  ASSERT_TRUE(store_->AddScan("bob", scan).ok()) << "again";
  Reopen();
  EXPECT_TRUE(store_->ReadScan("bob", scan).ok());
  EXPECT_TRUE(store_->Insert(job).ok());
}

TEST_F(JobStoreTest, AScanThatWasRemovedIsNobodys) {
  const std::string scan = Scan(5, "ann");
  Pass(8 * kDay);
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(scan).status()));
  EXPECT_EQ(Blob(5), scan) << "somebody else sends it";
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", scan).status()));
}

TEST_F(JobStoreTest, AScanGoesWhenNobodyNeedsIt) {
  const StoredJob job = NewJob("a", "ann");
  const std::string scan = job.job.scan_id();
  ASSERT_TRUE(store_->Insert(job).ok());
  ASSERT_TRUE(store_->AddScan("bob", scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->RemoveScan("eve", scan)));
  ASSERT_TRUE(store_->RemoveScan("ann", scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", scan).status()));
  ASSERT_TRUE(store_->RemoveScan("bob", scan).ok());
  EXPECT_TRUE(store_->blobs().Read(scan).ok()) << "a job is not finished";
  ASSERT_TRUE(store_->Finish(Finished(job), {{2}}).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(scan).status()));
  Counts();
}

TEST_F(JobStoreTest, ARemovedJobTakesItsSurfaceAndScanAlong) {
  for (const char* id : {"a", "b"}) {
    ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
    ASSERT_TRUE(store_->Finish(Finished(NewJob(id)), {std::vector<uint8_t>(9, *id)}).ok());
  }
  EXPECT_EQ(store_->blobs().List()->size(), 3u);
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_EQ(store_->blobs().List()->size(), 2u) << "the other job names the scan too";
  ASSERT_TRUE(store_->Remove("", "b").ok());
  EXPECT_EQ(store_->blobs().List()->size(), 0u);
  EXPECT_EQ(*store_->Clean(), 0);
  EXPECT_EQ(Counts(), "");
}

TEST_F(JobStoreTest, ASurfaceOfTwoJobsStaysForTheOther) {
  for (const char* id : {"a", "b"}) {
    ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
    ASSERT_TRUE(store_->Finish(Finished(NewJob(id)), {{7, 7}}).ok());
  }
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(store_->blobs().Read(store_->Get("", "b")->surface).ok());
  Counts();
}

TEST_F(JobStoreTest, AMeshIsABlobWhileItsJobNeedsIt) {
  StoredJob job = NewJob("a");
  v1::ControlMesh mesh;
  mesh.set_positions(std::string(50'000, 'x'));
  *job.header.mutable_options()->mutable_control()->mutable_control_mesh() = mesh;
  const auto kept = store_->Insert(job);
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_FALSE(kept->header.options().control().has_control_mesh());
  EXPECT_EQ(kept->mesh, ContentNameOf(mesh.SerializeAsString()));
  EXPECT_TRUE(store_->blobs().Read(kept->mesh).ok());
  EXPECT_EQ(store_->Unfinished()->front().mesh, kept->mesh);
  ASSERT_TRUE(store_->Finish(Finished(*kept), {{1}}).ok());
  EXPECT_FALSE(store_->blobs().Read(kept->mesh).ok());
  EXPECT_EQ(store_->Get("", "a")->mesh, kept->mesh) << "its name tells requests apart";
  Counts();
}

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

TEST_F(JobStoreTest, StoresOfEarlierVersionsGoOn) {
  for (const int version : {1, 2}) {
    StoredJob waiting = NewJob("a", "ann"), done = Finished(NewJob("b", "ann"));
    waiting.header.mutable_options()->mutable_control()->mutable_control_mesh()->set_positions(
        std::string(50'000, 'm'));
    const std::string scan = waiting.job.scan_id(), file = test_ / "store/jobs.db";
    done.surface = Blob(9, 70);
    store_.reset();
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file + end);
    {
      auto old = *Database::Open(file);
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
    EXPECT_TRUE(store_->ReadScan("ann", scan).ok()) << "who has a job of it";
    EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("bob", scan).status()));
    EXPECT_FALSE(std::filesystem::exists(file + ".old"));
    EXPECT_LT(std::filesystem::file_size(file), 200'000u);
    EXPECT_THAT(Counts(), testing::HasSubstr("ann: "));
    EXPECT_EQ(*Database::Open(file)->Version(), kSchemaVersion);
    ASSERT_TRUE(Database::Open(file)->Execute("DELETE FROM jobs").ok());
    Reopen();
  }
}

TEST_F(JobStoreTest, AStoreOfALaterVersionIsRefused) {
  Tamper("PRAGMA user_version = 99");
  EXPECT_EQ(JobStore::Open(test_ / "store").status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(JobStoreTest, AnEmptyDatabaseBesideBlobsIsRefused) {
  Blob(1);
  store_.reset();
  std::filesystem::resize_file(test_ / "store/jobs.db", 0);
  const absl::Status lost = JobStore::Open(test_ / "store").status();
  EXPECT_TRUE(absl::IsDataLoss(lost)) << lost;
  EXPECT_THAT(std::string(lost.message()), testing::HasSubstr("--repair"));
  std::filesystem::remove(test_ / "store/jobs.db");
  EXPECT_TRUE(absl::IsDataLoss(JobStore::Open(test_ / "store").status()));
}

TEST_F(JobStoreTest, ADamagedRowIsSetAside) {
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
TEST_F(JobStoreTest, AChangedRowIsDamaged) {
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

TEST_F(JobStoreTest, AStepOfTheClockRemovesNothing) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("a")), {{2}}).ok());
  wall_ += 9 * kDay;
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(store_->Get("", "a").ok()) << "while it runs";
  wall_ += 400 * kDay;
  Reopen();
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(store_->Get("", "a").ok()) << "while no server runs: a day";
  wall_ = 1000;  // as without a battery
  Reopen();
  ASSERT_TRUE(store_->Insert(NewJob("b")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("b")), {{3}}).ok());
  wall_ = 1'700'000'000'000;
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(store_->Get("", "b").ok());
  Pass(8 * kDay);
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "b").status())) << "time does pass";
}

TEST_F(JobStoreTest, TheClockGoesOnOverRestarts) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("a")), {{2}}).ok());
  for (int day = 0; day < 8; ++day) {
    ASSERT_TRUE(store_->Clean().ok());
    EXPECT_TRUE(day > 6 || store_->Get("", "a").ok()) << day;
    store_.reset();
    wall_ += kDay;  // nobody runs
    Reopen();
  }
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_FALSE(store_->Get("", "a").ok());
}

TEST_F(JobStoreTest, OwnersSeeTheirOwn) {
  ASSERT_TRUE(store_->Insert(NewJob("a", "ann")).ok());
  ASSERT_TRUE(store_->Insert(NewJob("b", "bob")).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Get("bob", "a").status()));
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "a").status()));
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("bob", 10, &before)), ElementsAre("b"));
  EXPECT_FALSE(store_->Find("bob", "r-a")->has_value());
  EXPECT_TRUE(store_->Find("ann", "r-a")->has_value());
}

TEST_F(JobStoreTest, ListsPagesNewestFirst) {
  for (const auto* id : {"a", "b", "c", "d", "e"}) ASSERT_TRUE(store_->Insert(NewJob(id)).ok());
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("e", "d"));
  EXPECT_NE(before, 0);
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("c", "b"));
  EXPECT_THAT(Ids(*store_->List("", 2, &before)), ElementsAre("a"));
  EXPECT_EQ(before, 0);
}

TEST_F(JobStoreTest, AFinishedJobStaysAsItIs) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Update(Finished(NewJob("a"))).ok());
  StoredJob again = NewJob("a");
  again.job.set_state(v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(store_->Get("", "a")->job.state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Remove("", "a")));
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(JobStoreTest, PageTokensTellNothingOfOtherOwners) {
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(store_->Insert(NewJob(absl::StrCat("a", i), "ann")).ok());
  for (const auto* id : {"x", "y"}) ASSERT_TRUE(store_->Insert(NewJob(id, "bob")).ok());
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("bob", 1, &before)), ElementsAre("y"));
  EXPECT_EQ(before, 2) << "his second job";
}

TEST_F(JobStoreTest, AgeRemovesFinishedJobsAndWhatTheyUsed) {
  ASSERT_TRUE(store_->Insert(NewJob("old")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("old")), {{2, 2}}).ok());
  const StoredJob waiting = NewJob("waiting", "ann");
  ASSERT_TRUE(store_->Insert(waiting).ok());
  Blob(9);  // as a crash leaves it
  Reopen();
  Pass(6 * kDay);
  ASSERT_TRUE(store_->Insert(NewJob("fresh")).ok());
  ASSERT_TRUE(store_->Finish(Finished(NewJob("fresh")), {{3, 3}}).ok());
  const std::string just_sent = Scan(10);
  Pass(2 * kDay);
  const auto stored = store_->Clean();
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(*stored, 2 * kJobRecordBytes + 10 + 10 + 2) << "two scans and a surface";
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "old").status()));
  EXPECT_TRUE(store_->Get("", "fresh").ok());
  EXPECT_TRUE(store_->Get("ann", "waiting").ok());
  EXPECT_TRUE(store_->blobs().Read(waiting.job.scan_id()).ok());
  EXPECT_TRUE(store_->blobs().Read(just_sent).ok());
  Counts();
}

// Uploads as many bytes as a scan of `owner`'s; OK, or why not.
class JobStoreRoomTest : public JobStoreTest {
 protected:
  absl::Status Upload(const std::string& owner, uint8_t value, int64_t bytes) {
    const std::string name = absl::StrCat(owner, ".", value);
    RILIEVO_RETURN_IF_ERROR(store_->BeginUpload(owner, name, bytes));
    auto writer = store_->uploads().Continue(name, 0);
    const std::string content(static_cast<size_t>(bytes), static_cast<char>(value));
    RILIEVO_RETURN_IF_ERROR(writer->Append(content));
    Pass(1);
    return store_->FinishUpload(owner, name, bytes, ContentNameOf(content), &*writer);
  }

  void Done(const std::string& owner, const std::string& id, size_t surface_bytes) {
    ASSERT_TRUE(store_->Insert(NewJob(id, owner)).ok());
    const std::vector<uint8_t> surface(surface_bytes, static_cast<uint8_t>(id[0]));
    Pass(1);
    ASSERT_TRUE(store_->Finish(Finished(NewJob(id, owner)), {surface}).ok());
  }

  std::vector<std::string> Jobs(const std::string& owner) {
    int64_t before = 0;
    return Ids(*store_->List(owner, 100, &before));
  }
};

TEST_F(JobStoreRoomTest, SizeTakesIdleScansFirstThenTheOldestJobs) {
  Reopen({.bytes = 40'000});
  ASSERT_TRUE(Upload("", 200, 9'000).ok());
  Done("", "a", 5'000);
  Done("", "b", 5'000);
  ASSERT_TRUE(Upload("", 201, 20'000).ok());
  EXPECT_FALSE(store_->ReadScan("", ContentNameOf(std::string(9'000, '\xc8'))).ok());
  EXPECT_THAT(Jobs(""), ElementsAre("b", "a"));
  ASSERT_TRUE(Upload("", 202, 30'000).ok()) << "both scans go, and the older job";
  EXPECT_THAT(Jobs(""), ElementsAre("b"));
  EXPECT_TRUE(absl::IsResourceExhausted(Upload("", 203, 40'001))) << "more than there ever is";
  EXPECT_THAT(Jobs(""), ElementsAre("b")) << "nothing is removed for what cannot fit";
  Counts();
}

TEST_F(JobStoreRoomTest, WhatIsNotFinishedStaysHoweverLittleRoomThereIs) {
  Reopen({.bytes = 5'000});
  ASSERT_TRUE(store_->Insert(NewJob("waiting")).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(Upload("", 1, 4'000)));
  EXPECT_THAT(Jobs(""), ElementsAre("waiting"));
  EXPECT_TRUE(store_->blobs().Read(NewJob("waiting").job.scan_id()).ok());
}

TEST_F(JobStoreRoomTest, AnOwnerAboveItsShareLosesItsOwn) {
  Reopen({.bytes = 40'000, .owner_bytes = 20'000});
  Done("ann", "a", 10'000);
  for (uint8_t i = 0; i < 9; ++i) EXPECT_TRUE(Upload("bob", i, 8'000).ok()) << int{i};
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  EXPECT_TRUE(Upload("ann", 100, 6'000).ok());
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  Counts();
}

TEST_F(JobStoreRoomTest, WhoTakesMostMakesRoomForWhoTakesLess) {
  Reopen({.bytes = 40'000});
  Done("ann", "a", 4'000);
  for (uint8_t i = 0; i < 4; ++i) ASSERT_TRUE(Upload("bob", i, 8'000).ok());
  EXPECT_THAT(Jobs("ann"), ElementsAre("a")) << "she takes less";
  ASSERT_TRUE(Upload("ann", 100, 9'000).ok()) << "of bob's";
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  Counts();
}

TEST_F(JobStoreRoomTest, AnUploadCountsWithAllThatItAnnounced) {
  Reopen({.bytes = 10'000});
  ASSERT_TRUE(store_->BeginUpload("", "u", 6'000).ok());
  ASSERT_TRUE(store_->BeginUpload("", "u", 6'000).ok()) << "once";
  auto writer = store_->uploads().Continue("u", 0);
  EXPECT_TRUE(absl::IsResourceExhausted(store_->BeginUpload("", "v", 6'000)));
  writer = absl::UnknownError("its stream is gone");
  EXPECT_TRUE(store_->BeginUpload("", "v", 6'000).ok()) << "a cut one makes room";
  Counts();
}

TEST_F(JobStoreTest, AScanThatIsCutOrLostIsForgotten) {
  const std::string scan = Scan(4, "ann");
  std::filesystem::resize_file(test_ / "store/blobs/" + scan, 5);
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", scan).status()));
  EXPECT_EQ(Scan(4, "ann"), scan) << "sent again";
  EXPECT_TRUE(store_->ReadScan("ann", scan).ok());
  ASSERT_TRUE(store_->SetScanAside(scan).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", scan).status()));
  EXPECT_TRUE(std::filesystem::exists(test_ / "store/damaged/" + scan));
}

TEST_F(JobStoreTest, ASurfaceThatNobodyTakesLeavesNothing) {
  const StoredJob job = NewJob("a");
  ASSERT_TRUE(store_->Insert(job).ok());
  ASSERT_TRUE(store_->Remove("", "a").ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Finish(Finished(job), {{1, 2}})));
  EXPECT_EQ(store_->blobs().List()->size(), 0u);
}

TEST_F(JobStoreTest, AFolderHasOneServer) {
  EXPECT_EQ(JobStore::Open(test_ / "store").status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
