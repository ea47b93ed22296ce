// The parts of a large job, which several workers of a store do.
#include <thread>

#include "server/conversion/call_error.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr PartStep kStep = PartStep::kFit;

class SharedPartsTest : public StoreFixture {
 protected:
  SharedPartsTest() : StoreFixture(StorePlace::kPostgres) { settings_.checked_share = 4; }

  void SetUp() override {
    StoreFixture::SetUp();
    if (!store_) return;
    database_ = std::make_unique<PostgresDatabase>(url_);
    // Its sum is 96 = 0 modulo 4: part 0 is done twice, and part 4.
    ASSERT_TRUE(store_->Insert(NewJob("`", "ann")).ok());
    job_ = **store_->Claim({.worker = "leader", .memory = 1'000});
    ASSERT_TRUE(Keep(*store_->TakePart(Leader(), PartStep::kCoarse, 1)->claim, "coarse").ok());
  }

  PartWorker Leader() const { return {"`", "ann", "leader", job_.claim, 1'000, "1"}; }
  static PartWorker Helper(const std::string& name = "helper") {
    return {"`", "ann", name, 0, 1'000, "1"};
  }

  std::optional<PartClaim> Take(const PartWorker& worker, int count = 3) {
    const auto turn = store_->TakePart(worker, kStep, count);
    EXPECT_TRUE(turn.ok()) << turn.status();
    return turn.ok() ? turn->claim : std::nullopt;
  }
  int TakenPart(const PartWorker& worker) {
    const auto claim = Take(worker);
    return claim ? claim->part : -1;
  }

  absl::Status Keep(const PartClaim& claim, const std::string& bytes) {
    std::string_view left = bytes;
    return store_->KeepPart(
        claim, [&]() -> absl::StatusOr<std::string_view> { return std::exchange(left, {}); });
  }

  std::string Bytes(int part, PartStep step = kStep) {
    std::string name, bytes;
    const auto file = store_->ReadPart("`", step, part, &name);
    if (!file.ok()) return std::string(file.status().message());
    bytes.resize(static_cast<size_t>(*file->Size()));
    EXPECT_TRUE(file->ReadAt(0, bytes.data(), bytes.size()).ok());
    return bytes;
  }

  std::vector<std::string> ToHelp(const std::string& worker, int64_t memory = 1'000,
                                  const std::set<std::string>& except = {},
                                  const std::string& recipe = "1") {
    const auto job = store_->JobToHelp({.worker = worker, .memory = memory}, recipe, except);
    EXPECT_TRUE(job.ok()) << job.status();
    if (!job.ok() || !*job) return {};
    EXPECT_EQ((*job)->worker, NameOfHelper(worker));
    return {(*job)->job.job_id()};
  }

  StoredJob job_;
  std::unique_ptr<PostgresDatabase> database_;
};

TEST_F(SharedPartsTest, EachIsDoneOnceAndReadByAll) {
  EXPECT_THAT(ToHelp("helper"), IsEmpty()) << "it has no parts yet";
  const auto first = Take(Leader()), second = Take(Helper()), third = Take(Helper("other"));
  ASSERT_TRUE(first && second && third);
  EXPECT_THAT((std::vector{first->part, second->part, third->part}), ElementsAre(0, 1, 2));
  EXPECT_FALSE(Take(Helper()));
  ASSERT_TRUE(Keep(*third, "33").ok());
  ASSERT_TRUE(Keep(*second, "22").ok());
  EXPECT_EQ(store_->TakePart(Leader(), kStep, 3)->done, 2);
  EXPECT_EQ(Bytes(1) + Bytes(2), "2233");
  EXPECT_TRUE(absl::IsInternal(store_->TakePart(Helper(), kStep, 5).status())) << "cut otherwise";
}

TEST_F(SharedPartsTest, ASampleIsDoneTwiceByAnotherWorkerAndCompared) {
  const auto first = Take(Leader());
  ASSERT_TRUE(Keep(*first, "right").ok());
  ASSERT_TRUE(Keep(*Take(Leader()), "1").ok());
  ASSERT_TRUE(Keep(*Take(Leader()), "2").ok());
  const auto again = Take(Helper());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->part, 0);
  ASSERT_TRUE(Keep(*again, "right").ok());
  const auto all = store_->TakePart(Helper(), kStep, 3);
  EXPECT_EQ(all->done, 3);
  EXPECT_FALSE(all->claim);
  EXPECT_THAT(reports_, IsEmpty());
}

// Of two that differ; the first time the second one was right.
TEST_F(SharedPartsTest, AThirdResultDecides) {
  for (const bool second_is_right : {true, false}) {
    const PartStep step = second_is_right ? PartStep::kFit : PartStep::kSurfels;
    const auto take = [&](const PartWorker& worker) { return *store_->TakePart(worker, step, 2); };
    reports_.clear();
    ASSERT_TRUE(Keep(*take(Leader()).claim, second_is_right ? "wrong" : "right").ok());
    ASSERT_TRUE(Keep(*take(Leader()).claim, "1").ok());
    const auto again = take(Helper()).claim;
    ASSERT_EQ(again->part, 0);
    ASSERT_TRUE(Keep(*again, second_is_right ? "right" : "wrong").ok());
    const PartQueue::Turn third = take(Helper("third"));
    EXPECT_EQ(third.done, 1) << "it is in doubt";
    ASSERT_TRUE(Keep(*third.claim, "right").ok());
    EXPECT_EQ(Bytes(0, step), "right");
    const std::string wrong = second_is_right ? "leader" : "helper";
    ASSERT_EQ(reports_.size(), 1u);
    EXPECT_THAT(reports_[0], testing::HasSubstr(wrong + " has found is wrong"));
    EXPECT_EQ(take(Leader()).was_wrong, second_is_right) << "what it has taken of it is wrong";
    EXPECT_EQ(take(Helper()).was_wrong, !second_is_right);
    EXPECT_EQ(take(Leader()).done, 2);
    EXPECT_FALSE(take(Leader()).was_wrong) << "it may begin anew";
  }
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("wrong")).ok());
  Counts();
}

// Of two workers that differ, whoever is asked again would find the same again.
TEST_F(SharedPartsTest, OneOfTwoThatDifferDoesNotDecide) {
  ASSERT_TRUE(Keep(*Take(Leader()), "right").ok());
  for (const char* bytes : {"1", "2"}) ASSERT_TRUE(Keep(*Take(Leader()), bytes).ok());
  EXPECT_THAT(ToHelp("leader"), IsEmpty());
  EXPECT_FALSE(Take(Helper(NameOfHelper("leader")))) << "it is the same worker";
  EXPECT_THAT(ToHelp("helper"), ElementsAre("`"));
  ASSERT_TRUE(Keep(*Take(Helper(NameOfHelper("helper"))), "wrong").ok());
  for (const char* name : {"helper", "leader"}) {
    EXPECT_FALSE(Take(Helper(name))) << name;
    EXPECT_FALSE(Take(Helper(NameOfHelper(name)))) << name;
  }
  EXPECT_THAT(ToHelp("helper"), IsEmpty());
  EXPECT_THAT(ToHelp("third"), ElementsAre("`"));
  EXPECT_FALSE(Take(Leader())) << "a third worker may come";
  ASSERT_TRUE(database_->Execute("UPDATE job_parts SET lease_until = now()").ok());
  const auto last = Take(Leader());
  ASSERT_TRUE(last);
  const absl::Status undecided = Keep(*last, "right");
  EXPECT_TRUE(absl::IsInternal(undecided)) << undecided;
  EXPECT_THAT(std::string(undecided.message()), testing::HasSubstr("no third worker"));
  // As if the worker that led were back as one who helps, and had the part.
  ASSERT_TRUE(database_
                  ->Execute("UPDATE job_parts SET found_by = 'helper/help', other_by ="
                            " 'leader/help' WHERE part = 0 AND other <> ''")
                  .ok());
  EXPECT_TRUE(absl::IsInternal(Keep(*last, "wrong")));
  EXPECT_EQ(Bytes(0), "right");
  EXPECT_THAT(reports_, IsEmpty());
  Counts();
}

TEST_F(SharedPartsTest, ThreeThatDifferDecideNothing) {
  const auto take = [&](const PartWorker& worker) {
    return *store_->TakePart(worker, PartStep::kHeights, 2)->claim;
  };
  ASSERT_TRUE(Keep(take(Leader()), "a").ok());
  ASSERT_TRUE(Keep(take(Leader()), "1").ok());
  ASSERT_TRUE(Keep(take(Helper()), "b").ok());
  EXPECT_TRUE(absl::IsInternal(Keep(take(Helper("third")), "c")));
  Counts();
}

TEST_F(SharedPartsTest, ALateResultChangesNothing) {
  const auto late = Take(Helper("late"));
  EXPECT_THAT(ToHelp("helper"), ElementsAre("`"));
  EXPECT_THAT(ToHelp("leader"), IsEmpty());
  EXPECT_THAT(ToHelp("helper", 1'000, {"`"}), IsEmpty());
  ASSERT_TRUE(store_->ReleaseParts("`", "late").ok());
  auto now = Take(Helper());
  ASSERT_EQ(now->part, late->part);
  EXPECT_GT(now->number, late->number);
  EXPECT_TRUE(Keep(*late, "late").ok()) << "it would be the same";
  EXPECT_EQ(store_->TakePart(Leader(), kStep, 3)->done, 0);
  ASSERT_TRUE(Keep(*now, "00").ok());
  EXPECT_EQ(Bytes(0), "00");
  EXPECT_TRUE(absl::IsFailedPrecondition(
      store_->TakePart({"`", "ann", "leader", job_.claim + 1, 1'000, "1"}, kStep, 3).status()));
}

TEST_F(SharedPartsTest, APartThatEndsThreeWorkersIsLeftToTheLeader) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = absl::StrCat("w", i);
    for (int part = 0; part < 3; ++part) EXPECT_EQ(TakenPart(Helper(name)), part);
    ASSERT_TRUE(store_->ReleaseParts("`", name).ok());
  }
  EXPECT_EQ(TakenPart(Helper()), -1);
  EXPECT_THAT(ToHelp("helper"), IsEmpty());
  ASSERT_TRUE(database_->Execute("UPDATE queue SET worker = ''").ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(Helper(), kStep, 3).status()))
      << "nobody is there to do it";
  ASSERT_TRUE(database_->Execute("UPDATE queue SET worker = 'leader'").ok());
  EXPECT_EQ(TakenPart(Leader()), 0);
}

TEST_F(SharedPartsTest, WhoHelpsIsToldThatAJobWaitsForItsPlace) {
  for (int part = 0; part < 3; ++part) EXPECT_EQ(TakenPart(Leader()), part);
  EXPECT_FALSE(store_->TakePart(Helper(), kStep, 3)->job_waits);
  StoredJob next = NewJob("next");
  next.memory = 1'001;
  ASSERT_TRUE(store_->Insert(next).ok());
  EXPECT_FALSE(store_->TakePart(Helper(), kStep, 3)->job_waits) << "it has not the memory";
  ASSERT_TRUE(database_->Execute("UPDATE queue SET memory = 1000").ok());
  EXPECT_TRUE(store_->TakePart(Helper(), kStep, 3)->job_waits);
  EXPECT_FALSE(store_->TakePart(Leader(), kStep, 3)->job_waits);
  ASSERT_TRUE(store_->ReleaseParts("`", "leader").ok());
  EXPECT_FALSE(store_->TakePart(Helper(), kStep, 3)->job_waits) << "it has something to do";
}

TEST_F(SharedPartsTest, NobodyHelpsToPutThemTogether) {
  ASSERT_TRUE(store_->TakePart(Leader(), PartStep::kCoded, 1)->claim);
  ASSERT_TRUE(store_->ReleaseParts("`", "leader").ok());
  EXPECT_THAT(ToHelp("helper"), IsEmpty());
  EXPECT_FALSE(store_->TakePart(Helper(), PartStep::kCoded, 1)->claim);
}

TEST_F(SharedPartsTest, WhatIsCodedIsMeasuredWithHelp) {
  const PartClaim coded = *store_->TakePart(Leader(), PartStep::kCoded, 1)->claim;
  ASSERT_TRUE(Keep(coded, "00").ok());
  EXPECT_TRUE(store_->TakePart(Helper(), PartStep::kMeasured, 2)->claim);
  EXPECT_THAT(ToHelp("another"), ElementsAre("`"));
  ASSERT_TRUE(store_->DropPart(Leader(), PartStep::kCoded, 0, ContentNameOf("00")).ok());
  EXPECT_THAT(ToHelp("another"), IsEmpty()) << "there is nothing to measure";
}

TEST_F(SharedPartsTest, BlocksAreCodedWithHelpOnceItIsKnownHowExactly) {
  const PartClaim uncoded = *store_->TakePart(Leader(), PartStep::kUncoded, 1)->claim;
  EXPECT_FALSE(store_->TakePart(Helper(), PartStep::kUncoded, 1)->claim);
  ASSERT_TRUE(Keep(uncoded, "00").ok());
  ASSERT_TRUE(store_->TakePart(Leader(), PartStep::kBlocks, 3)->claim);
  EXPECT_THAT(ToHelp("another"), ElementsAre("`"));
  EXPECT_TRUE(store_->TakePart(Helper(), PartStep::kBlocks, 3)->claim);
  ASSERT_TRUE(store_->DropPart(Leader(), PartStep::kUncoded, 0, ContentNameOf("00")).ok());
  EXPECT_THAT(ToHelp("another"), IsEmpty()) << "it would wait for what nobody does again";
}

TEST_F(SharedPartsTest, WhoWaitsForCodingLeavesForAnyJob) {
  ASSERT_TRUE(store_->TakePart(Leader(), PartStep::kCoded, 1)->claim);
  EXPECT_FALSE(store_->TakePart(Helper(), PartStep::kCoded, 1)->job_waits);
  StoredJob next = NewJob("next");
  ASSERT_TRUE(store_->Insert(next).ok());
  ASSERT_TRUE(database_->Execute("UPDATE queue SET suspect = 1 WHERE worker = ''").ok());
  EXPECT_TRUE(store_->TakePart(Helper(), PartStep::kCoded, 1)->job_waits);
}

TEST_F(SharedPartsTest, WhoWaitsForTheShapeLeavesForAJobThatWaits) {
  ASSERT_TRUE(database_->Execute("DELETE FROM job_parts").ok());
  ASSERT_TRUE(Keep(*store_->TakePart(Leader(), PartStep::kLeftOut, 1)->claim, "left out").ok());
  ASSERT_TRUE(store_->TakePart(Leader(), PartStep::kCoarse, 1)->claim);
  EXPECT_FALSE(store_->TakePart(Helper(), PartStep::kCoarse, 1)->job_waits);
  ASSERT_TRUE(store_->Insert(NewJob("next")).ok());
  EXPECT_TRUE(store_->TakePart(Helper(), PartStep::kCoarse, 1)->job_waits);
}

TEST_F(SharedPartsTest, WhoHelpedMayShapeWhatTheLeaderHasNotBegun) {
  ASSERT_TRUE(database_->Execute("DELETE FROM job_parts").ok());
  ASSERT_TRUE(Keep(*store_->TakePart(Leader(), PartStep::kLeftOut, 1)->claim, "left out").ok());
  PartWorker other = Helper("other");
  other.recipe = "2";
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(other, PartStep::kCoarse, 1).status()));
  EXPECT_TRUE(store_->TakePart(Helper(), PartStep::kCoarse, 1)->claim);
}

TEST_F(SharedPartsTest, ADamagedOneIsDoneAgain) {
  ASSERT_TRUE(Keep(*Take(Leader()), "00").ok());
  ASSERT_TRUE(Keep(*Take(Leader()), "11").ok());
  ASSERT_TRUE(store_->DropPart(Leader(), kStep, 1, ContentNameOf("11")).ok());
  EXPECT_THAT(reports_, ElementsAre("part 1 of job ` is damaged; it is set aside"));
  EXPECT_EQ(TakenPart(Helper()), 1);
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("11")).ok());
  EXPECT_EQ(Bytes(0), "00");
  // Another worker has seen the damage too, after the part was done again or the job ended.
  ASSERT_TRUE(store_->DropPart(Leader(), kStep, 0, ContentNameOf("11")).ok());
  ASSERT_TRUE(store_->DropPart(Leader(), kStep, 1, "").ok());
  EXPECT_EQ(reports_.size(), 1u);
  EXPECT_EQ(Bytes(0), "00");
  Counts();
}

TEST_F(SharedPartsTest, TheyGoWithTheJobHoweverItEnds) {
  const auto done = Take(Leader()), begun = Take(Helper());
  ASSERT_TRUE(Keep(*done, "some bytes").ok());
  EXPECT_THAT(Counts(), testing::HasSubstr(ContentNameOf("some bytes")));
  Reopen();
  StoredJob ended = job_;
  ended.job.set_state(v1::JOB_STATE_CANCELLED);
  ASSERT_TRUE(store_->Update(ended).ok());
  EXPECT_FALSE(*store_->IsUnfinished("`"));
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("some bytes")).ok());
  EXPECT_EQ(*database_->Number("SELECT COUNT(*) FROM job_parts"), 0);
  EXPECT_TRUE(absl::IsFailedPrecondition(Keep(*begun, "late")));
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(Helper(), kStep, 3).status()));
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("late")).ok());
  Counts();
}

// Ann's job keeps 40 bytes free, and Bob has a scan that nobody needs.
TEST_F(SharedPartsTest, TheStoreKeepsRoomForThem) {
  const int64_t before = *Tables().TotalBytes();
  const std::string of_bob = Scan(2, "bob");
  StoredJob large = NewJob("large", "ann");
  large.parts_bytes = 40;
  ASSERT_TRUE(store_->Insert(large).ok());
  const int64_t all = before + 10 + kJobRecordBytes + 40;
  EXPECT_EQ(*Tables().TotalBytes(), all);
  Reopen({.bytes = all});
  job_ = **store_->Claim({.worker = "leader", .memory = 1'000});
  ASSERT_EQ(job_.job.job_id(), "large");
  const PartWorker leader = {"large", "ann", "leader", job_.claim, 1'000, "1"};
  ASSERT_TRUE(Keep(*Take(leader), std::string(30, 'a')).ok());
  EXPECT_EQ(*Tables().TotalBytes(), all);
  EXPECT_EQ(*Tables().BytesOf("ann"), all - 10);
  const StoredJob other = NewJob("other", "carl");
  EXPECT_TRUE(absl::IsResourceExhausted(store_->Insert(other).status())) << "it is kept free";
  const auto second = Take(leader), third = Take(leader);
  ASSERT_TRUE(Keep(*second, std::string(10, 'b')).ok());
  const absl::Status full = Keep(*third, std::string(20, 'c'));
  EXPECT_EQ(StatedError(full)->reason, ErrorCause::kStoreFull);
  EXPECT_TRUE(store_->BytesOfScan("bob", of_bob).ok()) << "who takes less loses nothing";
  EXPECT_TRUE(Keep(*third, std::string(30, 'a')).ok()) << "these bytes are there already";
  ASSERT_TRUE(database_->Execute("UPDATE job_parts SET twice = 1 WHERE part = 0").ok());
  const auto check = Take({"large", "ann", "helper", 0, 1'000, "1"});
  EXPECT_TRUE(Keep(*check, std::string(50, 'd')).ok()) << "it is compared, not kept";
  EXPECT_EQ(*Tables().TotalBytes(), all);
  job_.job.set_state(v1::JOB_STATE_CANCELLED);
  ASSERT_TRUE(store_->Update(job_).ok());
  EXPECT_EQ(*Tables().TotalBytes(), all - 40) << "its record stays";
}

// Both have seen that there is room when they come to take it.
TEST_F(SharedPartsTest, RoomForThemIsPromisedOnce) {
  const int64_t before = *Tables().TotalBytes();
  StoredJob jobs[] = {NewJob("first", "ann"), NewJob("second", "ann")};
  for (StoredJob& job : jobs) job.parts_bytes = 40;
  Reopen({.bytes = before + 2 * kJobRecordBytes + 79});
  absl::Status inserted[2];
  std::vector<std::jthread> threads;
  const auto both_wait = [&]() -> absl::Status {
    for (int i = 0; i < 2; ++i) {
      threads.emplace_back([&, i] { inserted[i] = store_->Insert(jobs[i]).status(); });
    }
    for (int64_t waiting = 0; waiting < 2;) {
      waiting = *database_->Number(
          "SELECT COUNT(*) FROM pg_locks JOIN pg_database ON pg_database.oid = database WHERE"
          " locktype = 'advisory' AND NOT granted AND datname = current_database()");
    }
    return absl::OkStatus();
  };
  ASSERT_TRUE(database_->Transact(both_wait).ok());
  threads.clear();
  EXPECT_NE(inserted[0].ok(), inserted[1].ok());
  EXPECT_EQ(StatedError(inserted[inserted[0].ok() ? 1 : 0])->reason, ErrorCause::kStoreFull);
}

TEST_F(SharedPartsTest, ThoseOfAnotherVersionAreNotMixedIn) {
  ASSERT_TRUE(Keep(*Take(Leader()), "00").ok());
  EXPECT_THAT(ToHelp("helper", 1'000, {}, /*recipe=*/"2"), IsEmpty());
  PartWorker newer = Leader();
  newer.recipe = "2";
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(newer, kStep, 3).status()));
  ++newer.claim;
  ASSERT_TRUE(store_->LeadParts(newer).ok());
  EXPECT_EQ(Bytes(0), "00") << "it has no such claim";
  --newer.claim;
  ASSERT_TRUE(store_->LeadParts(newer).ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(Helper(), kStep, 3).status()))
      << "it does not begin anew by its own recipe";
  EXPECT_EQ(Take(newer, /*count=*/5)->part, 0);
  EXPECT_TRUE(absl::IsFailedPrecondition(store_->TakePart(Helper(), kStep, 3).status()));
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("00")).ok());
  Counts();
}

// Servers of an older version know no parts.
TEST_F(SharedPartsTest, ThoseOfAJobThatIsGoneAreSweptUp) {
  ASSERT_TRUE(Keep(*Take(Leader()), "some bytes").ok());
  ASSERT_TRUE(database_->Execute("DELETE FROM queue").ok());
  ASSERT_TRUE(store_->Clean().ok());
  EXPECT_EQ(*database_->Number("SELECT COUNT(*) FROM job_parts"), 0);
  EXPECT_FALSE(store_->blobs().BytesOf(ContentNameOf("some bytes")).ok());
}

TEST_F(SharedPartsTest, LeasesRunOutUnlessTheyAreRenewed) {
  ASSERT_TRUE(Take(Leader(), 4));
  ASSERT_TRUE(Take(Helper(NameOfHelper("leader")), 4));
  ASSERT_TRUE(Take(Helper("lost"), 4));
  // What a worker took without hearing of it, as when its connection broke.
  ASSERT_TRUE(
      database_->Execute("UPDATE job_parts SET worker = 'leader', claim = 1 WHERE part = 3").ok());
  ASSERT_TRUE(
      database_->Execute("UPDATE job_parts SET lease_until = now() - interval '1 second'").ok());
  const char* const kYoung =
      "SELECT CAST(pg_postmaster_start_time() >= now() - interval '15 seconds' AS INTEGER)";
  while (*database_->Number(kYoung) != 0) std::this_thread::sleep_for(std::chrono::seconds(1));
  ASSERT_TRUE(store_->Renew({.worker = "leader", .memory = 1'000}).ok());
  EXPECT_EQ(Take(Helper(), 4)->part, 2) << "the leader's go on, and where it helps";
  EXPECT_EQ(Take(Helper(), 4)->part, 3) << "it holds but one of each";
}

}  // namespace
}  // namespace rilievo
