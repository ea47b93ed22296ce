// What time and size remove.
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/job_store_fixture.h"

namespace rilievo {
namespace {

using testing::ElementsAre;

TEST_P(JobStoreTest, AStepOfTheClockRemovesNothing) {
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

TEST_P(JobStoreTest, TheClockGoesOnOverRestarts) {
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

TEST_P(JobStoreTest, AgeRemovesFinishedJobsAndWhatTheyUsed) {
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
    RILIEVO_RETURN_IF_ERROR((*writer)->Append(content));
    Pass(1);
    return store_->FinishUpload(owner, name, bytes, ContentNameOf(content), writer->get());
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

TEST_P(JobStoreRoomTest, SizeTakesIdleScansFirstThenTheOldestJobs) {
  Reopen({.bytes = 40'000});
  ASSERT_TRUE(Upload("", 200, 9'000).ok());
  Done("", "a", 5'000);
  Done("", "b", 5'000);
  ASSERT_TRUE(Upload("", 201, 20'000).ok());
  EXPECT_FALSE(store_->BytesOfScan("", ContentNameOf(std::string(9'000, '\xc8'))).ok());
  EXPECT_THAT(Jobs(""), ElementsAre("b", "a"));
  ASSERT_TRUE(Upload("", 202, 30'000).ok()) << "both scans go, and the older job";
  EXPECT_THAT(Jobs(""), ElementsAre("b"));
  EXPECT_TRUE(absl::IsResourceExhausted(Upload("", 203, 40'001))) << "more than there ever is";
  EXPECT_THAT(Jobs(""), ElementsAre("b")) << "nothing is removed for what cannot fit";
  Counts();
}

TEST_P(JobStoreRoomTest, WhatIsNotFinishedStaysHoweverLittleRoomThereIs) {
  Reopen({.bytes = 5'000});
  ASSERT_TRUE(store_->Insert(NewJob("waiting")).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(Upload("", 1, 4'000)));
  EXPECT_THAT(Jobs(""), ElementsAre("waiting"));
  EXPECT_TRUE(store_->blobs().Read(NewJob("waiting").job.scan_id()).ok());
}

// Its scan is the oldest that is idle.
TEST_P(JobStoreRoomTest, AJobKeepsItsScanAndTakesNothingInVain) {
  Reopen({.bytes = 12'000, .owner_bytes = 10'000});
  Done("ann", "a", 1'000);
  StoredJob of_ann = NewJob("large", "ann");
  Done("bob", "b", 500);
  ASSERT_TRUE(Upload("ann", 200, 3'000).ok());
  of_ann.parts_bytes = 8'000;
  const auto refused = StatedError(store_->Insert(of_ann).status());
  ASSERT_TRUE(refused && refused->reason == ErrorCause::kStoreFull);
  EXPECT_THAT(refused->message,
              testing::HasSubstr("10048 bytes are needed, and no more than 9990"));
  EXPECT_THAT(Jobs("ann"), ElementsAre("a")) << "all of it would not be enough";
  of_ann.parts_bytes = 7'000;
  const auto inserted = store_->Insert(of_ann);
  ASSERT_TRUE(inserted.ok()) << inserted.status();
  EXPECT_THAT(Jobs("ann"), ElementsAre("large"));
  // Within bob's share, but not beside ann's job.
  StoredJob of_bob = NewJob("too large", "bob");
  of_bob.parts_bytes = 7'900;
  EXPECT_TRUE(absl::IsResourceExhausted(store_->Insert(of_bob).status()));
  EXPECT_THAT(Jobs("bob"), ElementsAre("b"));
  Counts();
}

TEST_P(JobStoreRoomTest, AnOwnerAboveItsShareLosesItsOwn) {
  Reopen({.bytes = 40'000, .owner_bytes = 20'000});
  Done("ann", "a", 10'000);
  for (uint8_t i = 0; i < 9; ++i) EXPECT_TRUE(Upload("bob", i, 8'000).ok()) << int{i};
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  EXPECT_TRUE(Upload("ann", 100, 6'000).ok());
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  Counts();
}

TEST_P(JobStoreRoomTest, WhoTakesMostMakesRoomForWhoTakesLess) {
  Reopen({.bytes = 40'000});
  Done("ann", "a", 4'000);
  for (uint8_t i = 0; i < 4; ++i) ASSERT_TRUE(Upload("bob", i, 8'000).ok());
  EXPECT_THAT(Jobs("ann"), ElementsAre("a")) << "she takes less";
  ASSERT_TRUE(Upload("ann", 100, 9'000).ok()) << "of bob's";
  EXPECT_THAT(Jobs("ann"), ElementsAre("a"));
  Counts();
}

TEST_P(JobStoreRoomTest, AnUploadCountsWithAllThatItAnnounced) {
  Reopen({.bytes = 10'000});
  ASSERT_TRUE(store_->BeginUpload("", "u", 6'000).ok());
  ASSERT_TRUE(store_->BeginUpload("", "u", 6'000).ok()) << "once";
  auto writer = store_->uploads().Continue("u", 0);
  EXPECT_TRUE(absl::IsResourceExhausted(store_->BeginUpload("", "v", 6'000)));
  writer = absl::UnknownError("its stream is gone");
  EXPECT_TRUE(store_->BeginUpload("", "v", 6'000).ok()) << "a cut one makes room";
  Counts();
}

RILIEVO_OF_EVERY_STORE_BUT_S3(JobStoreRoomTest);

}  // namespace
}  // namespace rilievo
