// Several servers over one store in PostgreSQL.
#include <future>

#include "tests/unit/server/jobs/fleet_fixture.h"

namespace rilievo {
namespace {

TEST_F(FleetTest, AJobOfOneServerIsWorkedOnByAnotherAndReadAtAThird) {
  const auto front = Join(/*serve_only=*/true), reader = Join(/*serve_only=*/true);
  const std::string id = Created(front.get(), "r");
  EXPECT_EQ(Get(reader.get(), id).state(), v1::JOB_STATE_QUEUED) << "nobody works";
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_THAT(reader->core->metrics->Text(),
              ::testing::HasSubstr("rilievo_fleet_jobs{state=\"queued\"} 1\n"));
  const auto worker = Join(/*serve_only=*/false);
  const v1::Job done = WaitForState(reader.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u);
  v1::StreamSurfaceRequest request;
  request.set_job_id(id);
  grpc::ClientContext context;
  const auto stream = reader->stub->StreamSurface(&context, request);
  std::string surface;
  for (v1::StreamSurfaceResponse response; stream->Read(&response);) {
    surface += response.piece().data();
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(surface, "surface");
}

TEST_F(FleetTest, WhoWatchesElsewhereSeesTheSameNumbers) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  std::vector<v1::JobEvent> far, near;
  auto watched = std::async(std::launch::async, [&] { return Watch(front.get(), id, 0, &far); });
  auto beside = std::async(std::launch::async, [&] { return Watch(worker.get(), id, 0, &near); });
  std::this_thread::sleep_for(std::chrono::seconds(2));
  worker->work.Release();
  EXPECT_TRUE(watched.get().ok());
  EXPECT_TRUE(beside.get().ok());
  const auto progress = [](const std::vector<v1::JobEvent>& events) {
    for (const auto& event : events) {
      if (event.has_progress()) return event.sequence();
    }
    return uint64_t{0};
  };
  EXPECT_NE(progress(far), 0u) << "progress comes through the store";
  EXPECT_EQ(progress(far), progress(near));
  ASSERT_FALSE(far.empty());
  EXPECT_EQ(far.back().job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(far.back().sequence(), near.back().sequence());
  std::vector<v1::JobEvent> none;
  EXPECT_TRUE(Watch(front.get(), id, near.back().sequence(), &none).ok());
  EXPECT_TRUE(none.empty()) << "a watcher may go from server to server";
}

TEST_F(FleetTest, ACancelAtAnotherServerStopsTheWork) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  v1::CancelJobRequest request;
  request.set_job_id(id);
  v1::CancelJobResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(front->stub->CancelJob(&context, request, &response).ok());
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_CANCELLED);
  const std::string next = Created(front.get(), "next");
  EXPECT_TRUE(worker->work.WaitForBegun(2)) << "its place is free again";
  EXPECT_EQ(Get(worker.get(), id).state(), v1::JOB_STATE_CANCELLED);
}

TEST_F(FleetTest, AServerThatEndsInOrderLeavesItsJobsToOthers) {
  const auto front = Join(/*serve_only=*/true);
  auto first = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(first->work.WaitForBegun(1));
  std::vector<v1::JobEvent> events;
  auto watched = std::async(std::launch::async, [&] { return Watch(front.get(), id, 0, &events); });
  const auto second = Join(/*serve_only=*/false);
  // Its worker is stopped, not released.
  first->core->draining = true;
  first->service->BeginDrain();
  first->core->live_calls.StopAll(StopReason::kShutdown);
  EXPECT_TRUE(watched.get().ok()) << "who watches at a third one sees all of it";
  EXPECT_EQ(events.back().job().state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(events.back().job().attempts(), 2u);
}

TEST_F(FleetTest, WhatOneMachineCannotWorkOnAnotherDoes) {
  auto broken = Join(/*serve_only=*/false);
  broken->work.answers.assign(50, absl::UnavailableError("no worker starts here"));
  const std::string id = Created(broken.get(), "r");
  ASSERT_TRUE(broken->work.WaitForBegun(1));
  const auto whole = Join(/*serve_only=*/false);
  const v1::Job done = WaitForState(broken.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u) << "what was not an attempt does not count";
}

TEST_F(FleetTest, ADatabaseThatIsAwayIsWaitedFor) {
  const auto front = Join(/*serve_only=*/true);
  const auto worker = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(front.get(), "r");
  ASSERT_TRUE(worker->work.WaitForBegun(1));
  database_->Kill();
  v1::Job job;
  const grpc::Status away = Create(front.get(), "s", &job);
  EXPECT_EQ(away.error_code(), grpc::StatusCode::UNAVAILABLE) << away.error_message();
  EXPECT_EQ(ReasonOf(away), "STORE_BUSY");
  worker->work.Release();  // the job is done while nobody can be told
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  database_->Start();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!Create(front.get(), "s", &job).ok() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const v1::Job done = WaitForState(front.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.attempts(), 1u) << "its worker went on meanwhile";
}

TEST_F(FleetTest, TheLimitOfWaitingJobsIsTheFleets) {
  const auto one = Join(/*serve_only=*/true), two = Join(/*serve_only=*/true);
  int kept = 0;
  for (int i = 0; i < 30; ++i) {
    v1::Job job;
    Member* at = (i % 2 == 0 ? one : two).get();
    const grpc::Status status = Create(at, absl::StrCat("r", i), &job);
    if (!status.ok()) {
      EXPECT_EQ(ReasonOf(status), "JOBS_LIMIT");
      break;
    }
    ++kept;
  }
  EXPECT_EQ(kept, 10) << "half of it is one client's alone";
}

}  // namespace
}  // namespace rilievo
