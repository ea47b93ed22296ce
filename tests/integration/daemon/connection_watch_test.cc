// The watch over connections, in the program itself: whom it closes, and whom it leaves alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "client/library/reconstruction_client.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/raw_http2.h"
#include "tests/integration/daemon/simulated_scans.h"

namespace rilievo {
namespace {

using http2::RawConnection;
using http2::Type;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr char kStreamPath[] = "/rilievo.v1.ReconstructionService/Reconstruct";

// Calls that say nothing; whether all were begun before the connection was closed.
bool OpenCalls(RawConnection* connection, uint32_t count) {
  const std::string headers = http2::CallHeaders(kStreamPath);
  for (uint32_t i = 0; i < count; ++i) {
    if (!connection->Send(http2::Bytes({Type::kHeaders, http2::kEndHeaders, 2 * i + 1, headers}))) {
      return false;
    }
  }
  connection->Receive(milliseconds(300));
  return !connection->closed();
}

TEST(ConnectionWatch, ClosesWhoHasMoreCallsUnderWayThanAreAllowed) {
  const DaemonProcess daemon({"--max-connection-streams", "50", "--metrics", "127.0.0.1:0"});
  const ReconstructionClient other(ConnectPlaintext(daemon.address()));
  ASSERT_TRUE(other.GetCapabilities().ok());
  const int64_t before = daemon.ResidentBytes();
  RawConnection unaware(daemon.port());
  EXPECT_TRUE(OpenCalls(&unaware, 250)) << "it may not have learned of the limit yet";
  RawConnection hostile(daemon.port());
  EXPECT_FALSE(OpenCalls(&hostile, 20'000));
  const auto line = daemon.WaitForLine("\"event\":\"connection\"", seconds(10));
  ASSERT_TRUE(line.has_value());
  EXPECT_THAT(*line, HasSubstr("calls under way where 50 are allowed"));
  EXPECT_LT(daemon.PeakBytes() - before, 64'000'000);
  EXPECT_TRUE(other.GetCapabilities().ok());
}

TEST(ConnectionWatch, ClosesWhoSendsHeadersWithoutAnEnd) {
  const DaemonProcess daemon;
  RawConnection hostile(daemon.port());
  constexpr size_t kAnnounced = 64 << 20;
  hostile.Send(http2::Bytes({Type::kHeaders, 0, 1,
                             http2::CallHeaders(kStreamPath) + std::string(1, '\0') +
                                 http2::Integer(1, 7) + "x" + http2::Integer(kAnnounced, 7)}));
  const std::string piece = http2::Bytes({Type::kContinuation, 0, 1, std::string(1024, 'a')});
  size_t sent = 0;
  while (sent < kAnnounced && hostile.Send(piece)) sent += piece.size();
  EXPECT_LT(sent, kAnnounced / 4);
  EXPECT_TRUE(daemon.WaitForLine("bytes of headers without an end", seconds(10)).has_value());
}

// Whole scans on one connection, side by side, cost bytes and processor time too.
TEST(ConnectionWatch, LeavesHonestClientsAlone) {
  const DaemonProcess daemon({"--metrics", "127.0.0.1:0", "--queue", "16"});
  const auto channel = ConnectPlaintext(daemon.address());
  const PointCloud scan = SphereScan(150'000);
  std::vector<std::jthread> threads;
  std::atomic<int> right = 0;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      std::stop_source stop;
      ReconstructCallbacks callbacks;
      callbacks.progress = [&](const v1::Progress&) { stop.request_stop(); };
      const auto ended = ReconstructionClient(channel).Reconstruct(
          scan, {}, callbacks, {.timeout = {}, .stop = stop.get_token()});
      right += absl::IsCancelled(ended.status()) ? 1 : 0;
    });
  }
  threads.clear();
  EXPECT_EQ(right, 8) << "each was uploaded, and cancelled when its work began";
  for (const std::string& line : daemon.Log()) {
    EXPECT_THAT(line, testing::Not(HasSubstr("\"event\":\"connection\"")));
  }
}

}  // namespace
}  // namespace rilievo
