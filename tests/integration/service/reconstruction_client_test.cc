// The client library against the service, on a socket and in the process.
#include "client/library/reconstruction_client.h"

#include <thread>

#include "client/library/status_conversion.h"
#include "server/embedded_server.h"
#include "tests/integration/service/service_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::HasSubstr;

PointCloud SomePoints(Eigen::Index count) {
  PointCloud scan;
  scan.points = Eigen::Matrix3Xd::Random(3, count);
  return scan;
}

class ReconstructionClientTest : public ServiceTest {
 protected:
  ReconstructionClient Client() const {
    return ReconstructionClient(ConnectPlaintext(server_->address()));
  }
};

TEST_F(ReconstructionClientTest, BringsBytesReportAndCallbacks) {
  StartServer();
  std::vector<uint8_t> pieces;
  int64_t sent = 0;
  uint64_t announced = 0;
  bool queued = false;
  ReconstructCallbacks callbacks;
  callbacks.progress = [&](const v1::Progress& p) { queued |= p.stage() == v1::STAGE_QUEUED; };
  callbacks.sent = [&](int64_t points) { sent = points; };
  callbacks.surface = [&](const v1::SurfaceHeader& header) { announced = header.total_bytes(); };
  callbacks.piece = [&](const v1::SurfacePiece& piece) {
    pieces.insert(pieces.end(), piece.data().begin(), piece.data().end());
  };
  const auto result = Client().Reconstruct(SomePoints(100'000), {}, callbacks);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(work_.last_point_count(), 100'000);
  EXPECT_EQ(result->dss, work_.Encoded().Concatenate());
  EXPECT_EQ(pieces, result->dss);
  EXPECT_EQ(result->chunk_bytes, (std::vector<int64_t>{1000, 300'000, 0, 77}));
  EXPECT_EQ(result->report.points_in(), 100'000);
  EXPECT_EQ(sent, 100'000);
  EXPECT_EQ(announced, 301'077u);
  EXPECT_TRUE(queued);
}

TEST_F(ReconstructionClientTest, ReceivesALargeSurface) {
  work_.chunk_sizes = {5000, 20 << 20};
  StartServer();
  const auto result = Client().Reconstruct(SomePoints(50), {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->dss, work_.Encoded().Concatenate());
}

TEST_F(ReconstructionClientTest, AnEarlyRefusalEndsTheUploadWithItsReason) {
  ServerOptions options;
  options.max_points = 1000;
  StartServer(options);
  const auto start = steady_clock::now();
  // 72 MB: far more than any buffer between the two holds.
  const auto result = Client().Reconstruct(SomePoints(3'000'000), {});
  EXPECT_LT(SecondsSince(start), 5);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("header.point_count"));
  EXPECT_EQ(ErrorReason(result.status()), "LIMIT_EXCEEDED");
}

TEST_F(ReconstructionClientTest, TheStopTokenEndsTheCallAndTheWork) {
  work_.wait = true;
  StartServer();
  std::stop_source stop;
  std::jthread stopper([&] {
    ASSERT_TRUE(work_.WaitForBegun(1));
    stop.request_stop();
  });
  CallOptions call;
  call.stop = stop.get_token();
  const auto result = Client().Reconstruct(SomePoints(50), {}, {}, call);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(work_.WaitForStopped(1, milliseconds(1000)));
}

TEST_F(ReconstructionClientTest, AStopDuringTheUploadEndsIt) {
  StartServer();
  std::stop_source stop;
  ReconstructCallbacks callbacks;
  callbacks.sent = [&](int64_t) { stop.request_stop(); };
  CallOptions call;
  call.stop = stop.get_token();
  const auto start = steady_clock::now();
  const auto result = Client().Reconstruct(SomePoints(2'000'000), {}, callbacks, call);
  EXPECT_LT(SecondsSince(start), 2);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructionClientTest, TheTimeoutIsADeadline) {
  work_.wait = true;
  StartServer();
  CallOptions call;
  call.timeout = milliseconds(300);
  const auto start = steady_clock::now();
  const auto result = Client().Reconstruct(SomePoints(50), {}, {}, call);
  EXPECT_LT(SecondsSince(start), 1.3);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_TRUE(work_.WaitForStopped(1, milliseconds(1000)));
}

TEST_F(ReconstructionClientTest, TellsWhenToRetry) {
  work_.wait = true;
  ServerOptions options;
  options.max_concurrent_jobs = 1;
  options.max_queued_jobs = 0;
  StartServer(options);
  std::jthread first([this] { (void)Client().Reconstruct(SomePoints(50), {}); });
  ASSERT_TRUE(work_.WaitForBegun(1));
  const auto result = Client().Reconstruct(SomePoints(50), {});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ErrorReason(result.status()), "JOBS_LIMIT");
  EXPECT_GE(RetryDelay(result.status()).value_or(milliseconds(0)), milliseconds(1000));
  work_.Release();
}

TEST_F(ReconstructionClientTest, NobodyThereIsUnavailable) {
  StartServer();
  const std::string address = server_->address();
  server_.reset();
  const ReconstructionClient client(ConnectPlaintext(address));
  CallOptions call;
  call.timeout = milliseconds(3000);
  EXPECT_EQ(client.Reconstruct(SomePoints(50), {}, {}, call).status().code(),
            absl::StatusCode::kUnavailable);
  EXPECT_EQ(client.GetCapabilities(call).status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(ReconstructionClientTest, ServesInTheProcessAsOnASocket) {
  auto embedded = EmbeddedServer::Start({}, work_.Function());
  ASSERT_TRUE(embedded.ok()) << embedded.status();
  const ReconstructionClient client((*embedded)->channel());
  const auto capabilities = client.GetCapabilities();
  ASSERT_TRUE(capabilities.ok()) << capabilities.status();
  const auto result = client.Reconstruct(SomePoints(100'000), {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->dss, work_.Encoded().Concatenate());
  const auto refused = client.Reconstruct(SomePoints(3), {});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(ReconstructionClientTest, TheStopTokenReachesWorkInTheProcess) {
  work_.wait = true;
  auto embedded = EmbeddedServer::Start({}, work_.Function());
  ASSERT_TRUE(embedded.ok()) << embedded.status();
  std::stop_source stop;
  std::jthread stopper([&] {
    ASSERT_TRUE(work_.WaitForBegun(1));
    stop.request_stop();
  });
  CallOptions call;
  call.stop = stop.get_token();
  const auto result =
      ReconstructionClient((*embedded)->channel()).Reconstruct(SomePoints(50), {}, {}, call);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(work_.WaitForStopped(1, milliseconds(1000)));
}

}  // namespace
}  // namespace rilievo
