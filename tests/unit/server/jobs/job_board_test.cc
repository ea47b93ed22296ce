#include "server/jobs/job_board.h"

#include <filesystem>
#include <limits>

#include "server/jobs/job_run.h"
#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr uint64_t kLast = std::numeric_limits<uint64_t>::max();

class JobBoardTest : public JobsRoomTest {
 protected:
  JobBoard& board() { return core_->board; }
  // Whether the board has no job in time.
  bool WaitForEmpty() {
    for (int i = 0; i < 2000 && board().size() > 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return board().size() == 0;
  }
  static StoredJob Cancelled(StoredJob stored) {
    stored.job.set_attempts(1);
    stored.job.set_state(v1::JOB_STATE_CANCELLED);
    stored.job.set_sequence(SequenceOfState(v1::JOB_STATE_CANCELLED, stored.job.attempts()));
    SetTime(stored.job.mutable_end_time());
    return stored;
  }
  std::string Metrics() const { return service_->metrics->Text(); }
};

TEST_F(JobBoardTest, AJobIsWorkedOnAndLeavesTheBoard) {
  Open();
  board().Add(Stored("a"));
  const v1::Job done = WaitForEnd("a");
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u);
  EXPECT_EQ(done.surface().total_bytes(), 7u);
}

// Leases are renewed by the same thread.
TEST_F(JobBoardTest, FollowsOthersInTurnWhereTheTimeIsShort) {
  Open();
  std::vector<std::shared_ptr<JobEvents>> watched;
  for (const char* id : {"a", "b", "c"}) {
    const StoredJob stored = Stored(id);
    watched.push_back(board().EventsElsewhere("", stored.job));
    ASSERT_TRUE(core_->store->Update(Cancelled(stored)).ok());
  }
  for (int round = 1; round <= 3; ++round) {
    board().FollowOthers(std::chrono::steady_clock::now());
    int told = 0;
    for (const auto& events : watched) told += events->EndAfter(kLast).has_value() ? 1 : 0;
    EXPECT_EQ(told, round);
  }
}

TEST_F(JobBoardTest, CountsThoseOfEachClient) {
  work_.wait = true;
  Open();
  for (const char* id : {"a", "b"}) board().Add(Stored(id));
  StoredJob other = Stored("d");
  other.client = "d";
  board().Add(other);
  EXPECT_EQ(board().size(), 3);
  EXPECT_EQ(board().size("c"), 2);
  EXPECT_EQ(board().size("d"), 1);
  EXPECT_EQ(board().size("e"), 0);
}

TEST_F(JobBoardTest, AKilledAttemptIsRepeatedAndTheJobCountedOnce) {
  work_.answers = {absl::AbortedError("killed"), absl::AbortedError("killed")};
  Open();
  board().Add(Stored("a"));
  const v1::Job done = WaitForEnd("a");
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 3u);
  core_.reset();  // waits for the board's last word
  EXPECT_THAT(Metrics(), HasSubstr("rilievo_jobs_ended_total{kind=\"kept\",status=\"OK\"} 1\n"));
  EXPECT_THAT(Metrics(), HasSubstr("rilievo_attempts_ended_total{status=\"ABORTED\"} 2\n"));
  EXPECT_THAT(Metrics(), HasSubstr("rilievo_attempts_ended_total{status=\"OK\"} 1\n"));
}

// As where the disk or the network of the scans is away.
TEST_F(JobBoardTest, AScanThatCannotBeReadIsTriedOnceASecond) {
  Open();
  const StoredJob stored = Stored("a");
  const std::filesystem::path scan = test_ / ("store/blobs/" + stored.job.scan_id());
  std::filesystem::rename(scan, scan.string() + "x");
  std::filesystem::create_symlink(scan, scan);  // of itself
  board().Add(stored);
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_THAT(Metrics(), HasSubstr("rilievo_attempts_ended_total{status=\"UNAVAILABLE\"} 2\n"));
  std::filesystem::rename(scan.string() + "x", scan);
  const v1::Job done = WaitForEnd("a");
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u);
}

TEST_F(JobBoardTest, AJobWhoseWorkerIsAlwaysKilledFails) {
  work_.answers.assign(10, absl::AbortedError("killed"));
  Open();
  board().Add(Stored("a"));
  const v1::Job done = WaitForEnd("a");
  EXPECT_EQ(done.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(done.attempts(), 10u);
  EXPECT_EQ(done.error().code(), static_cast<int>(absl::StatusCode::kResourceExhausted));
}

TEST_F(JobBoardTest, CancelEndsWhatWaitsAndWhatRuns) {
  work_.wait = true;
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  Open(options);
  board().Add(Stored("running"));
  board().Add(Stored("waiting"));
  ASSERT_TRUE(work_.WaitForBegun(1));
  for (const char* id : {"waiting", "running"}) {
    const auto job = board().Cancel("", id);
    ASSERT_TRUE(job.ok()) << job.status();
    EXPECT_EQ(job->state(), v1::JOB_STATE_CANCELLED) << id;
    EXPECT_TRUE(job->has_end_time());
  }
  EXPECT_EQ(board().size(), 0);
  EXPECT_EQ(board().EventsOf("running"), nullptr);
  EXPECT_TRUE(absl::IsNotFound(board().Cancel("", "none").status()));
  EXPECT_TRUE(absl::IsNotFound(board().Cancel("other", "running").status()));
  EXPECT_EQ(board().Cancel("", "running")->state(), v1::JOB_STATE_CANCELLED) << "as it is";
  core_.reset();
  EXPECT_THAT(Metrics(),
              HasSubstr("rilievo_jobs_ended_total{kind=\"kept\",status=\"CANCELLED\"} 2\n"));
}

TEST_F(JobBoardTest, WhatEndedBeforeItCameIsNotWorkedOn) {
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  work_.wait = true;
  Open(options);
  board().Add(Stored("first"));
  ASSERT_TRUE(work_.WaitForBegun(1));
  const StoredJob cancelled = Stored("cancelled"), removed = Stored("removed");
  ASSERT_TRUE(board().Cancel("", "cancelled").ok());
  ASSERT_TRUE(core_->store->Remove("", "removed").ok());
  board().Add(cancelled);
  board().Add(removed);
  const auto watched = board().EventsOf("cancelled"), lost = board().EventsOf("removed");
  work_.Release();
  EXPECT_TRUE(WaitForEmpty()) << "their places are free again";
  EXPECT_EQ(watched->After(1)->job().state(), v1::JOB_STATE_CANCELLED);
  EXPECT_TRUE(absl::IsNotFound(lost->EndAfter(1).value_or(absl::OkStatus())));
  EXPECT_FALSE(work_.WaitForBegun(2, std::chrono::milliseconds(0)));
}

TEST_F(JobBoardTest, WhatEndedWhileItRanLeavesTheBoard) {
  work_.wait = true;
  Open();
  const StoredJob cancelled = Stored("cancelled");
  board().Add(cancelled);
  board().Add(Stored("removed"));
  ASSERT_TRUE(work_.WaitForBegun(2));
  const auto watched = board().EventsOf("cancelled"), lost = board().EventsOf("removed");
  ASSERT_TRUE(core_->store->Update(Cancelled(cancelled)).ok());
  ASSERT_TRUE(core_->store->Remove("", "removed").ok());
  work_.Release();
  EXPECT_TRUE(WaitForEmpty());
  EXPECT_TRUE(watched->EndAfter(kLast).value_or(absl::UnknownError("goes on")).ok());
  EXPECT_TRUE(absl::IsNotFound(lost->EndAfter(kLast).value_or(absl::OkStatus())));
}

TEST_F(JobBoardTest, AJobWhoseSurfaceCannotBeStoredFails) {
  work_.wait = true;
  Open();
  board().Add(Stored("a"));
  ASSERT_TRUE(work_.WaitForBegun(1));
  const auto watched = board().EventsOf("a");
  std::filesystem::rename(test_ / "store/blobs", test_ / "store/gone");
  work_.Release();
  EXPECT_TRUE(WaitForEmpty());
  EXPECT_TRUE(watched->EndAfter(kLast).value_or(absl::UnknownError("goes on")).ok());
  const v1::Job failed = core_->store->Get("", "a")->job;
  EXPECT_EQ(failed.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(failed.error().code(), static_cast<int>(absl::StatusCode::kInternal));
  EXPECT_FALSE(failed.has_surface());
}

TEST_F(JobBoardTest, TheNextBoardTakesUpWhatIsNotFinished) {
  work_.wait = true;
  Open();
  board().Add(Stored("a"));
  ASSERT_TRUE(work_.WaitForBegun(1));
  core_.reset();
  EXPECT_THAT(Metrics(), Not(HasSubstr("rilievo_jobs_ended_total{kind=\"kept\"")))
      << "it has not ended";
  work_.Release();
  Open();
  ASSERT_TRUE(board().Restore().ok());
  const v1::Job done = WaitForEnd("a");
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 2u);
}

TEST_F(JobBoardTest, ADrainBeginsNothingAndTellsWatchers) {
  work_.wait = true;
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  Open(options);
  board().Add(Stored("running"));
  ASSERT_TRUE(work_.WaitForBegun(1));
  board().Add(Stored("waiting"));
  const auto events = board().EventsOf("waiting");
  board().BeginDrain();
  ASSERT_TRUE(events->EndAfter(0).has_value());
  EXPECT_TRUE(absl::IsUnavailable(*events->EndAfter(0)));
  work_.Release();
  EXPECT_EQ(WaitForEnd("running").state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(core_->store->Get("", "waiting")->job.state(), v1::JOB_STATE_QUEUED);
}

}  // namespace
}  // namespace rilievo
