// Several servers and workers over one store.
#include <set>
#include <thread>

#include "server/postgres/postgres_blobs.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class SharedStoreTest : public StoreFixture {
 protected:
  SharedStoreTest() : StoreFixture(StorePlace::kPostgres) {}

  void SetUp() override {
    StoreFixture::SetUp();
    if (!store_) return;
    other_ = *OpenOne();
    database_ = std::make_unique<PostgresDatabase>(url_);
  }

  StoredJob Of(const std::string& client, const std::string& id, int64_t memory = 0) {
    StoredJob job = NewJob(id);
    job.client = client;
    job.memory = memory;
    EXPECT_TRUE(store_->Insert(job).ok());
    return job;
  }

  static ClaimDemand Worker(const std::string& name, int64_t memory = 1'000, bool idle = false) {
    return {.worker = name, .memory = memory, .idle = idle};
  }

  // Ids in the order in which one worker gets them.
  std::vector<std::string> Order(const ClaimDemand& worker) {
    std::vector<std::string> ids;
    for (;;) {
      const auto taken = store_->Claim(worker);
      EXPECT_TRUE(taken.ok()) << taken.status();
      if (!taken.ok() || !*taken) return ids;
      ids.push_back((*taken)->job.job_id());
    }
  }

  // A postmaster that runs for a lease's length takes leases for over that are.
  void LetLeasesRunOut() {
    ASSERT_TRUE(
        database_->Execute("UPDATE queue SET lease_until = now() - interval '1 second'").ok());
    const char* const kYoung =
        "SELECT CAST(pg_postmaster_start_time() >= now() - interval '15"
        " seconds' AS INTEGER)";
    while (*database_->Number(kYoung) != 0) std::this_thread::sleep_for(std::chrono::seconds(1));
  }

  std::unique_ptr<JobStore> other_;
  std::unique_ptr<PostgresDatabase> database_;
};

TEST_F(SharedStoreTest, WhatOneServerKeepsTheOtherHas) {
  const StoredJob job = Of("c", "a");
  EXPECT_EQ(other_->Get("", "a")->header.point_count(), 20u);
  const auto again = other_->Insert(job);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->job.job_id(), "a");
  int64_t before = 0;
  EXPECT_THAT(Ids(*other_->List("", 10, &before)), ElementsAre("a"));
  ASSERT_TRUE(other_->Finish(Finished(job), {{5, 5}}).ok());
  EXPECT_EQ(*store_->blobs().BytesOf(store_->Get("", "a")->surface), 2);
}

TEST_F(SharedStoreTest, TheSameRequestAtTwoServersMakesOneJob) {
  const StoredJob original = NewJob("x");
  std::vector<std::string> ids(8);
  std::vector<std::jthread> threads;
  for (size_t i = 0; i < ids.size(); ++i) {
    threads.emplace_back([&, i] {
      StoredJob mine = original;
      mine.job.set_job_id(absl::StrCat("j", i));
      ids[i] = (i % 2 == 0 ? store_ : other_)->Insert(mine)->job.job_id();
    });
  }
  threads.clear();
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), 1u);
  EXPECT_EQ(store_->CountUnfinished("c")->all, 1);
}

TEST_F(SharedStoreTest, AnUploadGoesOnAtTheOtherServer) {
  const std::string scan(3'000'000, 's'), name = ContentNameOf(scan);
  ASSERT_TRUE(store_->BeginUpload("ann", "u", 3'000'000).ok());
  auto first = *store_->uploads().Continue("u", 0);
  ASSERT_TRUE(first->Append(scan.substr(0, 1'000'000)).ok());
  EXPECT_EQ(*other_->uploads().StoredBytes("u"), 1'000'000);
  ASSERT_TRUE(other_->BeginUpload("ann", "u", 3'000'000).ok());
  auto second = *other_->uploads().Continue("u", 1'000'000);
  EXPECT_TRUE(absl::IsAborted(first->Append("late")));
  for (int i = 1; i < 3; ++i) ASSERT_TRUE(second->Append(scan.substr(0, 1'000'000)).ok());
  ASSERT_TRUE(other_->FinishUpload("ann", "u", 3'000'000, name, second.get()).ok());
  EXPECT_EQ(*store_->BytesOfScan("ann", name), 3'000'000);
  EXPECT_EQ(*store_->uploads().StoredBytes("u"), 0);
  Counts();
}

TEST_F(SharedStoreTest, EachJobIsTakenOnce) {
  for (int i = 0; i < 40; ++i) Of(absl::StrCat("c", i % 3), absl::StrCat("j", i));
  std::mutex mutex;
  std::multiset<std::string> taken;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, i] {
      JobStore* store = (i % 2 == 0 ? store_ : other_).get();
      for (;;) {
        const auto job = store->Claim(Worker(absl::StrCat("w", i)));
        EXPECT_TRUE(job.ok()) << job.status();
        if (!job.ok() || !*job) return;
        const std::lock_guard lock(mutex);
        taken.insert((*job)->job.job_id());
      }
    });
  }
  threads.clear();
  EXPECT_EQ(taken.size(), 40u);
  EXPECT_EQ(std::set<std::string>(taken.begin(), taken.end()).size(), 40u);
}

TEST_F(SharedStoreTest, WhatOthersAreJustTakingIsPassedOver) {
  for (int i = 0; i < 30; ++i) Of("c", absl::StrCat("j", i));
  const absl::Status held = database_->TransactBesideOthers([&]() -> absl::Status {
    EXPECT_TRUE(database_->Execute("SELECT 1 FROM queue ORDER BY number LIMIT 20 FOR UPDATE").ok());
    EXPECT_EQ((*store_->Claim(Worker("w")))->job.job_id(), "j20");
    return absl::OkStatus();
  });
  EXPECT_TRUE(held.ok()) << held;
  EXPECT_EQ((*store_->Claim(Worker("w")))->job.job_id(), "j0");
}

TEST_F(SharedStoreTest, TurnsGoRoundTheClients) {
  for (const char* id : {"a1", "a2", "a3"}) Of("ann", id);
  Of("bob", "b1");
  for (const char* id : {"c1", "c2"}) Of("cid", id);
  EXPECT_THAT(Order(Worker("w")), ElementsAre("a1", "b1", "c1", "a2", "c2", "a3"));
}

TEST_F(SharedStoreTest, AJobGoesToWhoHasTheMemory) {
  Of("c", "large", 5'000);
  Of("c", "huge", 50'000);
  Of("c", "small", 500);
  ASSERT_TRUE(store_->Renew(Worker("small", 1'000)).ok());
  ASSERT_TRUE(store_->Renew(Worker("large", 10'000)).ok());
  EXPECT_THAT(Order(Worker("small", 1'000, /*idle=*/true)), ElementsAre("small"));
  const auto large = store_->Claim(Worker("large", 10'000));
  EXPECT_EQ((*large)->job.job_id(), "large");
  EXPECT_EQ((*large)->memory, 5'000) << "who takes it need not estimate it again";
  EXPECT_THAT(Order(Worker("large", 10'000, /*idle=*/true)), ElementsAre("huge"))
      << "more than anybody has, so alone on one that has most";
}

TEST_F(SharedStoreTest, ASuspectIsTakenAloneAndLast) {
  Of("c", "suspect");
  Of("c", "other");
  StoredJob suspect = **store_->Claim(Worker("w"));
  ASSERT_EQ(suspect.job.job_id(), "suspect");
  suspect.unclean_ends = 3;
  ASSERT_TRUE(store_->Release(suspect).ok());
  EXPECT_THAT(Order(Worker("w")), ElementsAre("other"));
  EXPECT_THAT(Order(Worker("w", 1'000, /*idle=*/true)), ElementsAre("suspect"));
}

TEST_F(SharedStoreTest, ASuspectIsTakenByAWorkerWithItsMemory) {
  Of("c", "suspect", 5'000);
  ASSERT_TRUE(store_->Renew(Worker("small", 1'000)).ok());
  ASSERT_TRUE(store_->Renew(Worker("large", 10'000)).ok());
  StoredJob suspect = **store_->Claim(Worker("large", 10'000));
  suspect.unclean_ends = 3;
  ASSERT_TRUE(store_->Release(suspect).ok());
  EXPECT_THAT(Order(Worker("small", 1'000, /*idle=*/true)), IsEmpty());
  EXPECT_THAT(Order(Worker("large", 10'000, /*idle=*/true)), ElementsAre("suspect"));
}

// Bytes are written before they are on disk; a database that ends uncleanly may lose them.
TEST_F(SharedStoreTest, BytesThatTheDatabaseLostAreNotTakenForWritten) {
  const std::string piece(1000, 'a');
  auto writer = *store_->uploads().Continue("u", 0);
  ASSERT_TRUE(writer->Append(piece).ok());
  ASSERT_TRUE(writer->Append(piece).ok());
  ASSERT_TRUE(database_->Execute("DELETE FROM parts WHERE begins = 1000").ok());
  EXPECT_TRUE(absl::IsAborted(writer->Append(piece))) << "there is a gap";
  EXPECT_EQ(*store_->uploads().StoredBytes("u"), 1000) << "where it goes on";

  writer = *store_->uploads().Continue("u", 0);
  ASSERT_TRUE(writer->Append(piece).ok());
  ASSERT_TRUE(database_->Execute("DELETE FROM parts").ok());
  const absl::Status finished = writer->Finish(
      1000, ContentNameOf(piece), [](const auto& blob) { return blob.Adopt(nullptr); });
  EXPECT_TRUE(absl::IsUnavailable(finished)) << finished;
}

TEST_F(SharedStoreTest, AScratchFolderThatIsGoneIsNotSaidOfABlob) {
  std::vector<std::unique_ptr<Database>> one;
  one.push_back(std::make_unique<PostgresDatabase>(url_));
  const auto blobs =
      *PostgresBlobs::Open(std::make_shared<PostgresConnections>(std::move(one)), "/nonexistent");
  const std::string name = *blobs->Put({{'a'}});
  EXPECT_TRUE(absl::IsUnavailable(blobs->Read(name).status()));
}

TEST_F(SharedStoreTest, ALateResultChangesNothing) {
  Of("c", "a");
  StoredJob late = **store_->Claim(Worker("late"));
  EXPECT_THAT(Order(Worker("other")), IsEmpty()) << "its lease is not over";
  LetLeasesRunOut();
  int64_t freed = 0;
  ASSERT_TRUE(other_->Renew(Worker("other"), &freed).ok());
  EXPECT_EQ(freed, 1);
  StoredJob second = **other_->Claim(Worker("other"));
  EXPECT_GT(second.claim, late.claim);
  late = Finished(late);
  late.job.set_attempts(1);
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Update(late)));
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Finish(late, {{1}})));
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Release(late)));
  EXPECT_EQ(store_->Get("", "a")->job.state(), v1::JOB_STATE_QUEUED);
  EXPECT_TRUE(store_->Renew(Worker("late"))->empty()) << "it is told so";
  ASSERT_EQ(other_->Renew(Worker("other"))->size(), 1u);
  ASSERT_TRUE(other_->Finish(Finished(second), {{2}}).ok());
  EXPECT_EQ(store_->Get("", "a")->surface, ContentNameOf("\x02"));
  EXPECT_TRUE(other_->Renew(Worker("other"))->empty());
  Counts();
}

// As after a database was restored from a backup: the count of claims begins again where it was.
TEST_F(SharedStoreTest, TheSameNumberOfAnotherWorkerIsNoClaim) {
  Of("c", "a");
  StoredJob late = **store_->Claim(Worker("late"));
  ASSERT_TRUE(
      database_->Execute("UPDATE queue SET worker = '', claim = 0, lease_until = NULL").ok());
  const StoredJob second = **other_->Claim(Worker("other"));
  ASSERT_EQ(second.claim, late.claim);
  const JobClaim claim{.job_id = "a", .number = late.claim, .worker = late.worker};
  v1::JobEvent event;
  event.set_sequence(7);
  ASSERT_TRUE(store_->Tell(claim, event).ok());
  EXPECT_FALSE(other_->Look("", "a")->event.has_value());
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Update(late)));
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Finish(Finished(late), {{1}})));
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->Release(late)));
  EXPECT_TRUE(store_->Release(claim).ok());
  EXPECT_EQ(other_->Renew(Worker("other"))->size(), 1u) << "it has its job still";
  EXPECT_TRUE(other_->Finish(Finished(second), {{2}}).ok());
}

// Whoever takes it next counts the third unclean end: it must be alone by then.
TEST_F(SharedStoreTest, AJobThatTookTwoMachinesAlongIsASuspectTheThirdTime) {
  Of("c", "suspect");
  StoredJob begun = **store_->Claim(Worker("w"));
  begun.unclean_ends = 2;
  ASSERT_TRUE(store_->Update(begun).ok());
  Of("c", "other");
  LetLeasesRunOut();
  ASSERT_TRUE(store_->Renew(Worker("v")).ok());
  EXPECT_THAT(Order(Worker("v")), ElementsAre("other"));
  EXPECT_THAT(Order(Worker("v", 1'000, /*idle=*/true)), ElementsAre("suspect"));
}

TEST_F(SharedStoreTest, OneThatCouldNotBeTriedGoesBehindTheOthers) {
  for (const char* id : {"a", "b", "c"}) Of("c", id);
  const StoredJob first = **store_->Claim(Worker("w"));
  ASSERT_TRUE(store_->Release(first, /*last=*/true).ok());
  EXPECT_THAT(Order(Worker("w")), ElementsAre("b", "c", "a"));
}

TEST_F(SharedStoreTest, AnUploadIsBusyForAsLongAsItsEndTakes) {
  const std::string scan(2'500'000, 's'), name = ContentNameOf(scan);
  ASSERT_TRUE((*store_->uploads().Continue("u", 0))->Append(scan.substr(0, 1'000'000)).ok());
  auto writer = *store_->uploads().Continue("u", 1'000'000);
  ASSERT_TRUE(writer->Append(scan.substr(0, 1'500'000)).ok());
  ASSERT_TRUE(database_->Execute("UPDATE upload_turns SET busy_until = now()").ok());
  int moved = 0;
  writer->WhenMoved([&] { ++moved; });
  const absl::Status done = writer->Finish(2'500'000, name, [&](const StagedBlob& staged) {
    EXPECT_FALSE(*other_->uploads().RemoveIfIdle("u")) << "reading it takes its time";
    return staged.Adopt(nullptr);
  });
  EXPECT_TRUE(done.ok()) << done;
  EXPECT_EQ(moved, 2) << "once for each part";
  EXPECT_EQ(*store_->blobs().BytesOf(name), 2'500'000);
}

TEST_F(SharedStoreTest, ALeaseThatIsRenewedGoesOn) {
  Of("c", "a");
  ASSERT_TRUE(*store_->Claim(Worker("w")));
  LetLeasesRunOut();
  ASSERT_EQ(store_->Renew(Worker("w"))->size(), 1u) << "nobody has taken it meanwhile";
  EXPECT_THAT(Order(Worker("other")), IsEmpty());
}

TEST_F(SharedStoreTest, NoLeaseIsOverWhileTheDatabaseIsYoung) {
  Of("c", "a");
  StoredJob begun = **store_->Claim(Worker("w"));
  begun.job.set_state(v1::JOB_STATE_RUNNING);
  ASSERT_TRUE(store_->Update(begun).ok()) << "from here on it is on disk";
  RILIEVO_TEST_POSTGRES(server);
  server->Kill();
  EXPECT_TRUE(absl::IsUnavailable(store_->Claim(Worker("other")).status()));
  EXPECT_TRUE(absl::IsUnavailable(store_->Get("", "a").status()));
  server->Start();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_TRUE(
      database_->Execute("UPDATE queue SET lease_until = now() - interval '1 second'").ok());
  ASSERT_TRUE(other_->Renew(Worker("other")).ok());
  EXPECT_THAT(Order(Worker("other")), IsEmpty()) << "its worker may be about to renew it";
  EXPECT_EQ(store_->Renew(Worker("w"))->size(), 1u);
}

TEST_F(SharedStoreTest, WhatIsCancelledElsewhereIsNoLongerHeld) {
  StoredJob job = Of("c", "a");
  ASSERT_TRUE(*store_->Claim(Worker("w")));
  job.job.set_state(v1::JOB_STATE_CANCELLED);
  ASSERT_TRUE(other_->Update(job).ok());
  EXPECT_TRUE(store_->Renew(Worker("w"))->empty());
  EXPECT_EQ(store_->CountUnfinished("c")->all, 0);
}

TEST_F(SharedStoreTest, EventsAreSeenElsewhere) {
  Of("c", "a");
  const StoredJob mine = **store_->Claim(Worker("w"));
  EXPECT_FALSE(other_->Look("", "a")->event.has_value());
  v1::JobEvent event;
  event.set_sequence(7);
  event.mutable_progress()->set_fraction(0.5);
  ASSERT_TRUE(store_->Tell({.job_id = "a", .number = mine.claim, .worker = "w"}, event).ok());
  EXPECT_EQ(other_->Look("", "a")->event->sequence(), 7u);
  ASSERT_TRUE(store_->Release(mine).ok());
  EXPECT_FALSE(other_->Look("", "a")->event.has_value()) << "of an attempt that is over";
}

TEST_F(SharedStoreTest, ADamagedRowLeavesTheQueue) {
  for (const char* id : {"a", "b"}) Of("c", id);
  ASSERT_TRUE(database_->Execute(R"(UPDATE jobs SET job = '\xff' WHERE job_id = 'a')").ok());
  EXPECT_THAT(Order(Worker("w")), ElementsAre("b"));
  EXPECT_EQ(store_->CountUnfinished("c")->all, 1);
  EXPECT_TRUE(absl::IsDataLoss(other_->Get("", "a").status()));
}

// As when the first server of this version comes to those of the version before, which go on.
TEST_F(SharedStoreTest, TablesOfTheVersionBeforeAreBroughtUpToDateUnderItsServers) {
  Of("c", "a");
  const StoredJob mine = **store_->Claim(Worker("before"));
  ASSERT_TRUE(database_
                  ->Execute("DROP VIEW reserved; ALTER TABLE queue DROP owner, DROP parts_bytes;"
                            " ALTER TABLE job_parts DROP other, DROP other_by;"
                            " DELETE FROM rilievo_schema WHERE version = 4")
                  .ok());
  const auto upgraded = OpenOne();
  ASSERT_TRUE(upgraded.ok()) << upgraded.status();
  EXPECT_EQ(*database_->Number("SELECT COUNT(*) FROM reserved"), 0);
  EXPECT_EQ((*upgraded)->Get("", "a")->job.job_id(), "a");
  Of("c", "b");
  ASSERT_TRUE(store_->Finish(Finished(mine), {{1}}).ok());
  EXPECT_EQ((*(*upgraded)->Claim(Worker("now")))->job.job_id(), "b");
}

// Deletions and uploads of the same bytes at two servers: never a scan without its bytes.
TEST_F(SharedStoreTest, CollectionMeetsUploads) {
  const std::string bytes(10, '\x09');
  std::atomic<bool> over{false};
  std::jthread remover([&] {
    while (!over) {
      other_->RemoveScan("", ContentNameOf(bytes)).IgnoreError();
      EXPECT_TRUE(other_->Clean().ok());
    }
  });
  for (int i = 0; i < 100; ++i) {
    const std::string upload = absl::StrCat("u", i);
    ASSERT_TRUE(store_->BeginUpload("", upload, 10).ok());
    auto writer = *store_->uploads().Continue(upload, 0);
    ASSERT_TRUE(writer->Append(bytes).ok());
    const absl::Status kept =
        store_->FinishUpload("", upload, 10, ContentNameOf(bytes), writer.get());
    ASSERT_TRUE(kept.ok()) << kept;
    JobTables tables = Tables();
    EXPECT_TRUE(tables
                    .Alone([&]() -> absl::Status {
                      const bool named = *tables.BytesOfBlob(ContentNameOf(bytes)) >= 0;
                      EXPECT_TRUE(!named || store_->blobs().BytesOf(ContentNameOf(bytes)).ok());
                      return absl::OkStatus();
                    })
                    .ok());
  }
  over = true;
}

}  // namespace
}  // namespace rilievo
