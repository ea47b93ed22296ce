// How calls end before their time: cancel, deadline, a cut line, limits of time, shutdown.
#include <thread>

#include "tests/integration/line.h"
#include "tests/integration/service/service_fixture.h"

namespace rilievo {
namespace {

using grpc::StatusCode;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

class StoppingTest : public ServiceTest {
 protected:
  StoppingTest() { work_.wait = true; }

  // What stops a job must reach it within a second.
  static constexpr milliseconds kSoon{1000};

  // Whether the server comes to know a call within 10 s.
  bool WaitUntilBusy() {
    const auto end = steady_clock::now() + milliseconds(10'000);
    while (server_->WaitUntilIdle(milliseconds(0))) {
      if (steady_clock::now() > end) return false;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return true;
  }
};

TEST_F(StoppingTest, CancelReachesTheWorkWithinASecond) {
  StartServer();
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  context.TryCancel();
  EXPECT_TRUE(work_.WaitForStopped(1, kSoon));
  EXPECT_EQ(ReadToEnd(stream.get()).status.error_code(), StatusCode::CANCELLED);
  EXPECT_TRUE(server_->WaitUntilIdle(kSoon));
}

TEST_F(StoppingTest, TheDeadlineReachesTheWorkWithinASecond) {
  StartServer();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + milliseconds(400));
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  EXPECT_EQ(ReadToEnd(stream.get()).status.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(work_.WaitForStopped(1, kSoon));
}

TEST_F(StoppingTest, ACutLineReachesTheWorkWithinASecond) {
  StartServer();
  const std::string address = server_->address();
  Line line(std::stoi(address.substr(address.rfind(':') + 1)));
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub = v1::ReconstructionService::NewStub(
      grpc::CreateCustomChannel(line.address(), grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  const auto stream = stub->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  line.Cut();
  EXPECT_TRUE(work_.WaitForStopped(1, kSoon));
  EXPECT_EQ(ReadToEnd(stream.get()).status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_TRUE(server_->WaitUntilIdle(kSoon));
}

TEST_F(StoppingTest, CancelDuringTheUploadGivesThePlaceBack) {
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  options.max_queued_jobs = 0;
  StartServer(options);
  const auto stub = NewStub();
  {
    grpc::ClientContext context;
    const auto stream = stub->Reconstruct(&context);
    ASSERT_TRUE(stream->Write(HeaderRequest(50)));
    ASSERT_TRUE(stream->Write(PointsRequest(10)));
    ASSERT_TRUE(WaitUntilBusy()) << "what the server does not know yet has no place to give back";
    context.TryCancel();
    EXPECT_EQ(ReadToEnd(stream.get()).status.error_code(), StatusCode::CANCELLED);
  }
  EXPECT_TRUE(server_->WaitUntilIdle(kSoon));
  work_.Release();
  grpc::ClientContext context;
  const auto stream = stub->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  EXPECT_TRUE(ReadToEnd(stream.get()).status.ok());
}

TEST_F(StoppingTest, CancelWhileWaitingNeverBeginsTheWork) {
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  options.max_queued_jobs = 3;  // of four places one client gets two
  StartServer(options);
  const auto stub = NewStub();
  grpc::ClientContext first_context, second_context, third_context;
  const auto first = stub->Reconstruct(&first_context);
  SendWholeScan(first.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  const auto second = stub->Reconstruct(&second_context);
  SendWholeScan(second.get(), 60);
  v1::ReconstructResponse response;
  ASSERT_TRUE(second->Read(&response));
  EXPECT_EQ(response.progress().stage(), v1::STAGE_QUEUED);
  second_context.TryCancel();
  EXPECT_EQ(ReadToEnd(second.get()).status.error_code(), StatusCode::CANCELLED);

  // Its place is free while the first still works.
  ASSERT_TRUE(WaitForLogged(1, kSoon));
  const auto third = stub->Reconstruct(&third_context);
  SendWholeScan(third.get(), 70);
  ASSERT_TRUE(third->Read(&response));
  EXPECT_EQ(response.progress().stage(), v1::STAGE_QUEUED);
  work_.Release();
  EXPECT_TRUE(ReadToEnd(first.get()).status.ok());
  EXPECT_TRUE(ReadToEnd(third.get()).status.ok());
  EXPECT_EQ(work_.begun(), 2);
  EXPECT_EQ(work_.last_point_count(), 70);
}

TEST_F(StoppingTest, ASurfaceThatNobodyReadsTakesOfTheMemory) {
  work_.wait = false;
  work_.chunk_sizes = {50'000'000};
  ServerOptions options;
  options.memory_budget = 40'000'000;
  StartServer(options);
  const auto stub = NewStub();
  grpc::ClientContext slow_context;
  const auto slow = stub->Reconstruct(&slow_context);
  SendWholeScan(slow.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  const auto ask = [&] {
    grpc::ClientContext context;
    const auto stream = stub->Reconstruct(&context);
    SendWholeScan(stream.get(), 50);
    return ReadToEnd(stream.get()).status;
  };
  grpc::Status status;
  const auto start = steady_clock::now();
  do {
    status = ask();
  } while (status.ok() && SecondsSince(start) < 10);
  EXPECT_EQ(status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(Reason(status), "JOBS_LIMIT");
  EXPECT_TRUE(RetryInfoOf(status));
  EXPECT_TRUE(ReadToEnd(slow.get()).status.ok());
  EXPECT_TRUE(ask().ok()) << "it was given back";
}

TEST_F(StoppingTest, OverTheLimitOnJobsIsAnsweredAtOnceWithARetryTime) {
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  options.max_queued_jobs = 0;
  StartServer(options);
  const auto stub = NewStub();
  grpc::ClientContext first_context;
  const auto first = stub->Reconstruct(&first_context);
  SendWholeScan(first.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));

  for (int i = 0; i < 20; ++i) {
    const auto start = steady_clock::now();
    grpc::ClientContext context;
    const auto stream = stub->Reconstruct(&context);
    stream->Write(HeaderRequest(50));
    const Outcome outcome = ReadToEnd(stream.get());
    EXPECT_LT(SecondsSince(start), 0.5);
    EXPECT_EQ(outcome.status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(Reason(outcome.status), "JOBS_LIMIT");
    const auto retry = RetryInfoOf(outcome.status);
    ASSERT_TRUE(retry.has_value());
    EXPECT_GE(retry->retry_delay().seconds(), 1);
    EXPECT_LE(retry->retry_delay().seconds(), 60);
  }

  // Who was told that the first job is done finds its place free.
  work_.Release();
  EXPECT_TRUE(ReadToEnd(first.get()).status.ok());
  for (int i = 0; i < 20; ++i) {
    grpc::ClientContext context;
    const auto stream = stub->Reconstruct(&context);
    SendWholeScan(stream.get(), 50);
    ASSERT_TRUE(ReadToEnd(stream.get()).status.ok()) << i;
  }
}

TEST_F(StoppingTest, WorkOverItsTimeIsStopped) {
  ServerOptions options;
  options.max_job_time = milliseconds(200);
  StartServer(options);
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  EXPECT_TRUE(work_.WaitForStopped(1, milliseconds(200) + kSoon));
  const Outcome outcome = ReadToEnd(stream.get());
  EXPECT_EQ(outcome.status.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(Reason(outcome.status), "JOB_TIME_LIMIT");
}

TEST_F(StoppingTest, AClientThatStopsSendingIsLetGo) {
  ServerOptions options;
  options.max_idle_time = milliseconds(300);
  StartServer(options);
  for (const bool with_header : {false, true}) {
    grpc::ClientContext context;
    const auto stream = NewStub()->Reconstruct(&context);
    if (with_header) stream->Write(HeaderRequest(50));
    const auto start = steady_clock::now();
    const Outcome outcome = ReadToEnd(stream.get());
    EXPECT_LT(SecondsSince(start), 1.3);
    EXPECT_EQ(outcome.status.error_code(), StatusCode::DEADLINE_EXCEEDED);
    EXPECT_EQ(Reason(outcome.status), "IDLE_LIMIT");
  }
}

// Each message in time, all of them for ever: the place would be held from the others.
TEST_F(StoppingTest, AClientThatTricklesIsLetGo) {
  ServerOptions options;
  options.max_job_time = milliseconds(700);
  StartServer(options);
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  ASSERT_TRUE(stream->Write(HeaderRequest(100000)));
  const auto start = steady_clock::now();
  while (stream->Write(PointsRequest(1))) {
    ASSERT_LT(SecondsSince(start), 10.0);
    std::this_thread::sleep_for(milliseconds(50));
  }
  const Outcome outcome = ReadToEnd(stream.get());
  EXPECT_EQ(outcome.status.error_code(), StatusCode::DEADLINE_EXCEEDED);
  EXPECT_EQ(Reason(outcome.status), "UPLOAD_TIME_LIMIT");
}

TEST_F(StoppingTest, AClientThatStopsReadingIsLetGo) {
  ServerOptions options;
  options.max_idle_time = milliseconds(300);
  work_.wait = false;
  work_.chunk_sizes = {1000, 64 << 20};
  StartServer(options);
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  EXPECT_TRUE(server_->WaitUntilIdle(milliseconds(5000)));
  EXPECT_FALSE(ReadToEnd(stream.get()).status.ok());
}

TEST_F(StoppingTest, DrainRefusesNewJobsAndFinishesOldOnes) {
  StartServer();
  const auto stub = NewStub();
  grpc::ClientContext first_context;
  const auto first = stub->Reconstruct(&first_context);
  SendWholeScan(first.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  server_->BeginDrain();
  grpc::ClientContext second_context;
  const auto second = stub->Reconstruct(&second_context);
  const Outcome refused = ReadToEnd(second.get());
  EXPECT_EQ(refused.status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(Reason(refused.status), "SHUTTING_DOWN");
  EXPECT_TRUE(RetryInfoOf(refused.status).has_value());
  EXPECT_FALSE(server_->WaitUntilIdle(milliseconds(50)));
  work_.Release();
  EXPECT_TRUE(ReadToEnd(first.get()).status.ok());
  EXPECT_TRUE(server_->WaitUntilIdle(kSoon));
}

TEST_F(StoppingTest, ShutdownStopsTheWorkAndSaysSo) {
  StartServer();
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  ASSERT_TRUE(work_.WaitForBegun(1));
  const auto start = steady_clock::now();
  server_->Shutdown();
  EXPECT_LT(SecondsSince(start), 2);
  EXPECT_EQ(work_.stopped(), 1);
  const Outcome outcome = ReadToEnd(stream.get());
  EXPECT_EQ(outcome.status.error_code(), StatusCode::UNAVAILABLE);
  EXPECT_EQ(Reason(outcome.status), "SHUTTING_DOWN");
}

// Calls that end in every way at every moment; nothing may be left over.
TEST_F(StoppingTest, ManyClientsInAllStatesLeaveNothingBehind) {
  work_.wait = false;
  ServerOptions options;
  options.max_concurrent_jobs = 2;
  options.max_queued_jobs = 4;
  StartServer(options);
  std::atomic<int> ok{0}, refused{0}, cancelled{0}, other{0};
  {
    std::vector<std::jthread> clients;
    for (int c = 0; c < 12; ++c) {
      clients.emplace_back([&, c] {
        const auto stub = NewStub();
        for (int i = 0; i < 25; ++i) {
          grpc::ClientContext context;
          const auto stream = stub->Reconstruct(&context);
          std::jthread canceller;
          if ((c + i) % 3 == 0) {
            canceller = std::jthread([&context, i] {
              std::this_thread::sleep_for(std::chrono::microseconds(200 * i));
              context.TryCancel();
            });
          }
          SendWholeScan(stream.get(), 50);
          const Outcome outcome = ReadToEnd(stream.get());
          switch (outcome.status.error_code()) {
            case StatusCode::OK:
              ++ok;
              if (!outcome.responses.back().has_summary()) ++other;
              break;
            case StatusCode::RESOURCE_EXHAUSTED:
              ++refused;
              break;
            case StatusCode::CANCELLED:
              ++cancelled;
              break;
            default:
              ++other;
              ADD_FAILURE() << outcome.status.error_message();
          }
        }
      });
    }
  }
  EXPECT_EQ(ok + refused + cancelled, 12 * 25);
  EXPECT_EQ(other, 0);
  EXPECT_GT(ok, 0);
  EXPECT_TRUE(server_->WaitUntilIdle(kSoon));
  // All places are free again.
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  EXPECT_TRUE(ReadToEnd(stream.get()).status.ok());
}

}  // namespace
}  // namespace rilievo
