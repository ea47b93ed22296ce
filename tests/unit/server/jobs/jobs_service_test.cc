#include "server/jobs/jobs_service.h"

#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

TEST_F(JobsServiceTest, AJobGoesItsWay) {
  Open();
  const v1::Job job = Submit("r");
  std::vector<v1::JobEvent> events;
  EXPECT_TRUE(Watch(job.job_id(), 0, &events).ok());
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back().job().state(), v1::JOB_STATE_SUCCEEDED);
  v1::GetJobRequest request;
  request.set_job_id(job.job_id());
  v1::GetJobResponse response;
  grpc::ClientContext context;
  EXPECT_TRUE(stub_->GetJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(JobsServiceTest, WhatAnEarlierServerLeftIsTakenUp) {
  work_.wait = true;
  Open();
  const std::string id = Submit("r").job_id();
  ASSERT_TRUE(work_.WaitForBegun(1));
  Close();
  work_.Release();
  Open();
  std::vector<v1::JobEvent> events;
  EXPECT_TRUE(Watch(id, 0, &events).ok());
  EXPECT_EQ(events.back().job().attempts(), 2u);
}

TEST_F(JobsServiceTest, ADrainSendsWatchersElsewhere) {
  work_.wait = true;
  Open();
  const std::string id = Submit("r").job_id();
  ASSERT_TRUE(work_.WaitForBegun(1));
  service_->BeginDrain();
  std::vector<v1::JobEvent> events;
  const grpc::Status status = Watch(id, 0, &events);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(status), "SHUTTING_DOWN");
}

TEST_F(JobsServiceTest, StreamsAreBounded) {
  ServerOptions options;
  options.max_calls = 1;
  work_.wait = true;
  Open(options);
  const std::string id = Submit("r").job_id();
  ASSERT_TRUE(work_.WaitForBegun(1)) << "a job that runs takes the only place";
  std::vector<v1::JobEvent> events;
  EXPECT_EQ(ReasonOf(Watch(id, 0, &events)), "CALLS_LIMIT");
}

TEST(JobsServiceWithoutStore, RefusesEveryCall) {
  ServiceCore core({}, {}, {}, std::make_unique<Doorkeeper>());
  auto service = JobsService::Open(&core);
  ASSERT_TRUE(service.ok());
  EXPECT_EQ((*service)->foreign_requests(), 0);
  (*service)->BeginDrain();
  grpc::ServerBuilder builder;
  builder.RegisterService(service->get());
  const auto server = builder.BuildAndStart();
  const auto stub = v1::JobsService::NewStub(server->InProcessChannel({}));
  grpc::ClientContext list_context, upload_context, watch_context;
  v1::ListJobsResponse listed;
  EXPECT_EQ(ReasonOf(stub->ListJobs(&list_context, {}, &listed)), "NO_STORE");
  v1::UploadScanResponse uploaded;
  EXPECT_EQ(ReasonOf(stub->UploadScan(&upload_context, &uploaded)->Finish()), "NO_STORE");
  v1::WatchJobResponse event;
  const auto watch = stub->WatchJob(&watch_context, {});
  EXPECT_FALSE(watch->Read(&event));
  EXPECT_EQ(ReasonOf(watch->Finish()), "NO_STORE");
  server->Shutdown();
}

}  // namespace
}  // namespace rilievo
