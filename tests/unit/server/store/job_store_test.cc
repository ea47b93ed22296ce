#include "server/store/job_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using testing::ElementsAre;

constexpr int64_t kNow = 1'700'000'000'000;

class JobStoreTest : public testing::Test {
 protected:
  JobStoreTest() { Reopen(); }

  void Reopen() {
    store_.reset();
    auto opened = JobStore::Open(test_ / "store");
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

  // Files and jobs are told apart by their age.
  void MakeOld(const std::string& blob) {
    std::filesystem::last_write_time(
        test_ / "store/blobs/" + blob,
        std::filesystem::file_time_type::clock::now() - std::chrono::hours(24 * 365 * 20));
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

  StoredJob Finished(StoredJob stored, int64_t end_ms) {
    stored.job.set_state(v1::JOB_STATE_SUCCEEDED);
    stored.job.mutable_end_time()->set_seconds(end_ms / 1000);
    return stored;
  }

  static std::vector<std::string> Ids(const std::vector<v1::Job>& jobs) {
    std::vector<std::string> ids;
    for (const auto& job : jobs) ids.push_back(job.job_id());
    return ids;
  }

  TestFolder test_;
  std::unique_ptr<JobStore> store_;
};

TEST_F(JobStoreTest, JobsOutliveTheStore) {
  ASSERT_TRUE(store_->Insert(NewJob("a")).ok());
  ASSERT_TRUE(store_->Insert(NewJob("b")).ok());
  StoredJob done = Finished(NewJob("a"), kNow);
  done.surface = Blob(2);
  ASSERT_TRUE(store_->Update(done).ok());
  Reopen();
  const auto a = store_->Get("", "a");
  ASSERT_TRUE(a.ok()) << a.status();
  EXPECT_EQ(a->job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(a->surface, done.surface);
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
  MakeOld(scan);
  ASSERT_TRUE(store_->Clean({.age_ms = 2000, .bytes = 1'000'000}, kNow).ok());
  EXPECT_EQ(Blob(5), scan) << "somebody else sends it";
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("ann", scan).status()));
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

TEST_F(JobStoreTest, AStoreOfTheVersionBeforeGoesOn) {
  const StoredJob job = NewJob("a", "ann");
  const std::string scan = job.job.scan_id(), file = test_ / "store/jobs.db";
  store_.reset();
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file + end);
  {
    auto old = *Database::Open(file, 1, kSchemaOfVersion1);
    auto insert = *old.Prepare(
        "INSERT INTO jobs(job_id, owner, request_id, client, scan, surface, end_ms, header, job)"
        " VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)");
    insert.Bind("a").Bind("ann").Bind("r-a").Bind("c").Bind(scan).Bind("").Bind(int64_t{0});
    insert.Bind(job.header.SerializeAsString()).Bind(job.job.SerializeAsString());
    ASSERT_TRUE(insert.Run().ok());
  }
  Reopen();
  const auto kept = store_->Get("ann", "a");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->job.request_id(), "r-a");
  EXPECT_EQ(kept->header.point_count(), 20u);
  EXPECT_EQ(store_->Unfinished()->size(), 1u);
  EXPECT_TRUE(store_->ReadScan("ann", scan).ok()) << "who has a job of it";
  EXPECT_TRUE(absl::IsNotFound(store_->ReadScan("bob", scan).status()));
  store_.reset();
  auto database = *Database::Open(file, 2, "");
  auto version = *database.Prepare("PRAGMA user_version");
  ASSERT_TRUE(*version.Step());
  EXPECT_EQ(version.Integer(0), 2);
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
  ASSERT_TRUE(store_->Update(Finished(NewJob("a"), kNow)).ok());
  StoredJob again = NewJob("a");
  again.job.set_state(v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(store_->Get("", "a")->job.state(), v1::JOB_STATE_SUCCEEDED);
  ASSERT_TRUE(store_->Remove("a").ok());
  EXPECT_TRUE(absl::IsNotFound(store_->Remove("a")));
  EXPECT_EQ(store_->Update(again).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(JobStoreTest, AgeRemovesFinishedJobsAndWhatTheyUsed) {
  const std::string scan = Blob(1);
  StoredJob old_job = NewJob("old"), fresh = NewJob("fresh"), waiting = NewJob("waiting");
  waiting.job.set_scan_id(Scan(3));
  for (const auto& job : {old_job, fresh, waiting}) ASSERT_TRUE(store_->Insert(job).ok());
  old_job.surface = Blob(2);
  ASSERT_TRUE(store_->Update(Finished(old_job, kNow - 5000)).ok());
  ASSERT_TRUE(store_->Update(Finished(fresh, kNow - 1000)).ok());
  const std::string unused = Blob(9);
  for (const auto& blob : {scan, old_job.surface, unused, waiting.job.scan_id()}) MakeOld(blob);
  const std::string just_uploaded = Blob(10);
  const auto stored = store_->Clean({.age_ms = 2000, .bytes = 1'000'000}, kNow);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(*stored, 30) << "two scans in use and one that just came";
  EXPECT_TRUE(absl::IsNotFound(store_->Get("", "old").status()));
  EXPECT_TRUE(store_->Get("", "fresh").ok());
  EXPECT_TRUE(store_->Get("", "waiting").ok());
  EXPECT_TRUE(store_->blobs().Read(just_uploaded).ok());
  EXPECT_TRUE(absl::IsNotFound(store_->blobs().Read(unused).status()));
}

TEST_F(JobStoreTest, SizeRemovesTheOldestFinishedFirst) {
  for (int i = 0; i < 4; ++i) {
    StoredJob job = NewJob(absl::StrCat("j", i));
    ASSERT_TRUE(store_->Insert(job).ok());
    const std::vector<uint8_t> surface(1000, static_cast<uint8_t>(100 + i));
    ASSERT_TRUE(store_->Finish(Finished(job, kNow - 10'000 * (4 - i)), {surface}).ok());
  }
  ASSERT_TRUE(store_->Insert(NewJob("waiting")).ok());
  const auto stored = store_->Clean({.age_ms = 1'000'000'000, .bytes = 2100}, kNow);
  ASSERT_TRUE(stored.ok());
  EXPECT_EQ(*stored, 2010);
  int64_t before = 0;
  EXPECT_THAT(Ids(*store_->List("", 10, &before)), ElementsAre("waiting", "j3", "j2"));
  EXPECT_EQ(store_->blobs().List()->size(), 3u) << "a scan and two surfaces";
  // What is not finished stays, however little room there is.
  EXPECT_EQ(*store_->Clean({.age_ms = 1'000'000'000, .bytes = 0}, kNow), 10);
  EXPECT_TRUE(store_->Get("", "waiting").ok());
}

TEST_F(JobStoreTest, AFolderHasOneServer) {
  EXPECT_EQ(JobStore::Open(test_ / "store").status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
