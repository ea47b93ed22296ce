#include "server/jobs/watch_job_call.h"

#include <future>

#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

class WatchJobCallTest : public JobsServiceTest {};

TEST_F(WatchJobCallTest, EventsComeInOrderAndEndWithTheJob) {
  work_.wait = true;
  Open();
  const std::string id = Submit("r").job_id();
  ASSERT_TRUE(work_.WaitForBegun(1));
  std::vector<v1::JobEvent> events;
  auto watched = std::async(std::launch::async, [&] { return Watch(id, 0, &events); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  work_.Release();
  EXPECT_TRUE(watched.get().ok());
  ASSERT_GE(events.size(), 2u);
  uint64_t before = 0;
  for (const v1::JobEvent& event : events) {
    EXPECT_GT(event.sequence(), before);
    before = event.sequence();
  }
  EXPECT_EQ(events.front().job().state(), v1::JOB_STATE_QUEUED) << "all that is known";
  EXPECT_EQ(events.back().job().state(), v1::JOB_STATE_SUCCEEDED);
}

TEST_F(WatchJobCallTest, WhatWasSeenIsNotSentAgain) {
  Open();
  const std::string id = Submit("r").job_id();
  std::vector<v1::JobEvent> events, again, none;
  ASSERT_TRUE(Watch(id, 0, &events).ok());
  EXPECT_TRUE(Watch(id, events.back().sequence() - 1, &again).ok());
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_TRUE(Watch(id, events.back().sequence(), &none).ok());
  EXPECT_TRUE(none.empty());
}

TEST_F(WatchJobCallTest, AJobThatIsNotIsNotFound) {
  Open();
  std::vector<v1::JobEvent> events;
  EXPECT_EQ(Watch("none", 0, &events).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(WatchJobCallTest, ACancelledWatcherLeaves) {
  work_.wait = true;
  Open();
  v1::WatchJobRequest request;
  request.set_job_id(Submit("r").job_id());
  ASSERT_TRUE(work_.WaitForBegun(1));
  grpc::ClientContext context;
  const auto stream = stub_->WatchJob(&context, request);
  v1::WatchJobResponse response;
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_EQ(core_->live_calls.size(), 2) << "the job and its watcher";
  context.TryCancel();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  for (int i = 0; i < 500 && core_->live_calls.size() > 1; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(core_->live_calls.size(), 1) << "the job goes on";
}

}  // namespace
}  // namespace rilievo
