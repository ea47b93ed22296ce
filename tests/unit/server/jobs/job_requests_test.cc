#include "server/jobs/job_requests.h"

#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

class JobRequestsTest : public JobsRoomTest {
 protected:
  static Caller As(const std::string& name) { return {name, name, "", ""}; }

  grpc::Status Create(const Caller& caller, const v1::CreateJobRequest& request,
                      v1::Job* job = nullptr) {
    v1::CreateJobResponse response;
    const grpc::Status status = CreateJob(core_.get(), caller, request, &response);
    if (job != nullptr) *job = response.job();
    return status;
  }

  v1::GetJobRequest Named(const std::string& id) const {
    v1::GetJobRequest request;
    request.set_job_id(id);
    return request;
  }
};

TEST_F(JobRequestsTest, TheSameRequestIsTheSameJob) {
  Open();
  v1::Job first, second;
  const auto request = Request("r", AddScan("ann"));
  Caller ann = As("ann");
  ann.trace_id = "0123";
  ASSERT_TRUE(Create(ann, request, &first).ok());
  EXPECT_EQ(first.state(), v1::JOB_STATE_QUEUED);
  EXPECT_EQ(first.trace_id(), "0123");
  EXPECT_EQ(first.job_id().size(), 32u);
  EXPECT_TRUE(Create(ann, request, &second).ok());
  EXPECT_EQ(second.job_id(), first.job_id());
  auto changed = request;
  changed.mutable_header()->mutable_options()->set_seed(9);
  EXPECT_EQ(Create(ann, changed).error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(WaitForEnd(first.job_id(), "ann").state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(JobRequestsTest, WhatIsWrongIsToldBeforeAnythingIsKept) {
  Open();
  const std::string scan = AddScan("ann");
  const Caller ann = As("ann");
  using Code = grpc::StatusCode;
  auto few = Request("r", scan);
  few.mutable_header()->set_point_count(19);
  auto other_size = Request("r", scan);
  other_size.mutable_header()->set_point_count(21);
  EXPECT_EQ(Create(ann, Request("", scan)).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Create(ann, Request("r", "x")).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Create(ann, few).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Create(ann, other_size).error_code(), Code::INVALID_ARGUMENT);
  EXPECT_EQ(Create(ann, Request("r", std::string(64, '0'))).error_code(), Code::NOT_FOUND);
  EXPECT_EQ(core_->board.size(), 0);
  service_->draining = true;
  EXPECT_EQ(Create(ann, Request("r", scan)).error_code(), Code::UNAVAILABLE);
}

TEST_F(JobRequestsTest, AnothersScanIsAsOneThatIsNot) {
  Open();
  const grpc::Status guessed = Create(As("bob"), Request("r", AddScan("ann")));
  const grpc::Status none = Create(As("bob"), Request("r", std::string(64, '0')));
  EXPECT_EQ(guessed.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(guessed.error_message(), none.error_message());
}

TEST_F(JobRequestsTest, OneClientLeavesPlacesInTheQueue) {
  work_.wait = true;
  ServerOptions options;
  options.max_waiting_jobs = 4;
  Open(options);
  const std::string scan = AddScan("ann");
  AddScan("bob");
  EXPECT_TRUE(Create(As("ann"), Request("1", scan)).ok());
  EXPECT_TRUE(Create(As("ann"), Request("2", scan)).ok());
  const grpc::Status third = Create(As("ann"), Request("3", scan));
  EXPECT_EQ(third.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(third), "JOBS_LIMIT");
  EXPECT_THAT(third.error_message(), testing::HasSubstr("2 are yours"));
  EXPECT_TRUE(Create(As("bob"), Request("1", scan)).ok());
}

TEST_F(JobRequestsTest, JobsAreTheirOwners) {
  work_.wait = true;
  Open();
  v1::Job job;
  ASSERT_TRUE(Create(As("ann"), Request("r", AddScan("ann")), &job).ok());
  v1::GetJobResponse got;
  EXPECT_TRUE(GetJob(core_.get(), As("ann"), Named(job.job_id()), &got).ok());
  EXPECT_EQ(got.job().request_id(), "r");
  EXPECT_EQ(GetJob(core_.get(), As("bob"), Named(job.job_id()), &got).error_code(),
            grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(core_->store->foreign_requests(), 1);
  v1::ListJobsResponse listed;
  EXPECT_TRUE(ListJobs(core_.get(), As("bob"), {}, &listed).ok());
  EXPECT_EQ(listed.jobs_size(), 0);
  EXPECT_TRUE(ListJobs(core_.get(), As("ann"), {}, &listed).ok());
  EXPECT_EQ(listed.jobs_size(), 1);
  EXPECT_EQ(listed.next_page_token(), "");
  v1::CancelJobRequest cancel;
  cancel.set_job_id(job.job_id());
  v1::CancelJobResponse cancelled;
  EXPECT_FALSE(CancelJob(core_.get(), As("bob"), cancel, &cancelled).ok());
  EXPECT_TRUE(CancelJob(core_.get(), As("ann"), cancel, &cancelled).ok());
  EXPECT_EQ(cancelled.job().state(), v1::JOB_STATE_CANCELLED);
  v1::DeleteJobRequest remove;
  remove.set_job_id(job.job_id());
  v1::DeleteJobResponse removed;
  EXPECT_FALSE(DeleteJob(core_.get(), As("bob"), remove, &removed).ok());
  EXPECT_TRUE(DeleteJob(core_.get(), As("ann"), remove, &removed).ok());
  EXPECT_EQ(DeleteJob(core_.get(), As("ann"), remove, &removed).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

TEST_F(JobRequestsTest, UploadsOfTwoOwnersMeetNowhere) {
  Open();
  EXPECT_NE(UploadName(As("ann"), "u"), UploadName(As("bob"), "u"));
  EXPECT_EQ(UploadName({}, "u"), "u");
  v1::GetUploadRequest request;
  request.set_upload_id("u");
  auto writer = core_->store->uploads().Continue(UploadName(As("ann"), "u"), 0);
  ASSERT_TRUE((*writer)->Append("12345").ok());
  v1::GetUploadResponse response;
  EXPECT_TRUE(GetUpload(core_.get(), As("ann"), request, &response).ok());
  EXPECT_EQ(response.stored_bytes(), 5u);
  EXPECT_TRUE(GetUpload(core_.get(), As("bob"), request, &response).ok());
  EXPECT_EQ(response.stored_bytes(), 0u);
  request.set_upload_id("../u");
  EXPECT_EQ(GetUpload(core_.get(), As("ann"), request, &response).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace rilievo
