#include "server/jobs/job_run.h"

#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

class JobRunTest : public JobsRoomTest {
 protected:
  // A run of a job that the store holds.
  std::shared_ptr<JobRun> NewRun(int64_t part_points = 0) {
    StoredJob stored = Stored("a", "ann");
    stored.job.set_state(v1::JOB_STATE_RUNNING);
    stored.job.set_attempts(1);
    stored.job.set_part_points(static_cast<uint64_t>(part_points));
    events_ = std::make_shared<JobEvents>(stored.job);
    return std::make_shared<JobRun>(service_.get(), core_->store.get(), stored, events_);
  }

  std::shared_ptr<JobEvents> events_;
};

TEST_F(JobRunTest, SuccessBringsTheSurfaceAndIsKept) {
  Open();
  const auto run = NewRun();
  const JobOutcome outcome = run->Work();
  EXPECT_EQ(outcome.kind, JobOutcome::Kind::kFinished);
  EXPECT_EQ(outcome.job.job.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(outcome.job.job.report().road(), "spherical");
  EXPECT_EQ(outcome.job.job.surface().chunk_bytes_size(), 1);
  EXPECT_EQ(outcome.job.job.sequence(), SequenceOfState(v1::JOB_STATE_SUCCEEDED, 1));
  EXPECT_TRUE(JobRun::Keep(outcome, core_->store.get()).ok());
  EXPECT_FALSE(core_->store->Get("ann", "a")->surface.empty());
  EXPECT_TRUE(absl::IsFailedPrecondition(JobRun::Keep(outcome, core_->store.get())))
      << "it is finished";
  ASSERT_EQ(log_.size(), 1u);
  EXPECT_EQ(log_[0].id, "a");
  EXPECT_EQ(log_[0].owner, "ann");
  EXPECT_EQ(log_[0].code, absl::StatusCode::kOk);
  EXPECT_EQ(log_[0].bytes_out, 7);
}

TEST_F(JobRunTest, AnErrorOfTheWorkIsTheJobs) {
  work_.answers = {absl::InvalidArgumentError("collinear")};
  Open();
  const JobOutcome outcome = NewRun()->Work();
  EXPECT_EQ(outcome.kind, JobOutcome::Kind::kFinished);
  EXPECT_EQ(outcome.job.job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(outcome.job.job.error().code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
  EXPECT_TRUE(outcome.job.job.has_end_time());
}

TEST_F(JobRunTest, ADefectNamesTheJobByTheIdThatItsOwnerKnows) {
  work_.answers = {absl::InternalError("/srv/rilievo/core/loop.cc:12")};
  Open();
  service_->next_job = 4711;  // in the log, over all owners
  const v1::Job job = NewRun()->Work().job.job;
  EXPECT_EQ(job.error().code(), static_cast<int>(absl::StatusCode::kInternal));
  EXPECT_EQ(job.error().message(),
            "the server failed at job a; its operator finds the cause in the log");
  EXPECT_EQ(job.DebugString().find("4711"), std::string::npos);
}

TEST_F(JobRunTest, AWorkerWithoutAScratchFolderLeavesPartsToOthers) {
  Open();
  const JobOutcome outcome = NewRun(2048)->Work();
  EXPECT_EQ(outcome.kind, JobOutcome::Kind::kUntried);
  EXPECT_NE(log_.at(0).detail.find("--scratch"), std::string::npos);
  EXPECT_EQ(NewRun()->Work().kind, JobOutcome::Kind::kFinished);
}

TEST_F(JobRunTest, AKilledWorkerIsWorthAnotherAttempt) {
  work_.answers = {absl::AbortedError("killed")};
  Open();
  const JobOutcome outcome = NewRun()->Work();
  EXPECT_EQ(outcome.kind, JobOutcome::Kind::kKilled);
  EXPECT_EQ(outcome.job.job.state(), v1::JOB_STATE_FAILED) << "should it be the last one";
  EXPECT_EQ(log_.at(0).code, absl::StatusCode::kAborted);
}

TEST_F(JobRunTest, AStoppedRunIsAbandonedAndOneThatTakesTooLongFails) {
  work_.wait = true;
  ServerOptions options;
  options.max_job_time = std::chrono::seconds(5);
  Open(options);
  const auto stopped = NewRun();
  stopped->Tick(LiveCall::Clock::now());
  stopped->Stop(StopReason::kShutdown);
  EXPECT_EQ(stopped->Work().kind, JobOutcome::Kind::kAbandoned);
  EXPECT_EQ(log_.at(0).code, absl::StatusCode::kCancelled);

  core_->store->Remove("ann", "a").IgnoreError();
  const auto late = NewRun();
  late->Tick(LiveCall::Clock::now() + std::chrono::seconds(6));
  const JobOutcome outcome = late->Work();
  EXPECT_EQ(outcome.kind, JobOutcome::Kind::kFinished);
  EXPECT_EQ(outcome.job.job.state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(outcome.job.job.error().code(), static_cast<int>(absl::StatusCode::kDeadlineExceeded));
}

TEST_F(JobRunTest, WhatWasRemovedMeanwhileIsNotKept) {
  Open();
  const auto run = NewRun();
  ASSERT_TRUE(core_->store->Remove("ann", "a").ok());
  EXPECT_TRUE(absl::IsFailedPrecondition(JobRun::Keep(run->Work(), core_->store.get())));
}

TEST_F(JobRunTest, AScanThatIsGoneFailsTheJob) {
  Open();
  const auto run = NewRun();
  ASSERT_TRUE(core_->store->blobs().Remove(run->stored().job.scan_id()).ok());
  EXPECT_EQ(run->Work().job.job.state(), v1::JOB_STATE_FAILED);
}

}  // namespace
}  // namespace rilievo
