// The log of rilievod: whole, its own, and never in anybody's way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "client/library/reconstruction_client.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/raw_http2.h"
#include "tests/integration/daemon/simulated_scans.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr char kUnaryPath[] = "/rilievo.v1.ReconstructionService/GetCapabilities";

// A call that gRPC complains of on its log, with the words of the caller.
void SendBadHeader(int port, const std::string& value) {
  http2::RawConnection connection(port);
  connection.Send(http2::Bytes({http2::Type::kHeaders, http2::kEndHeaders | http2::kEndStream, 1,
                                http2::CallHeaders(kUnaryPath, value)}));
  connection.Receive(milliseconds(30));
}

TEST(Log, NoClientWritesALine) {
  DaemonProcess daemon;
  const auto start = steady_clock::now();
  const std::string forged = R"({"time":"2026-01-01T00:00:00Z","event":"job","owner":"forged"})";
  SendBadHeader(daemon.port(), absl::StrCat("x\n", forged));
  SendBadHeader(daemon.port(), "x\x1b[31m red");
  for (int i = 0; i < 60; ++i) SendBadHeader(daemon.port(), absl::StrCat("x", i));
  const double attacked = std::chrono::duration<double>(steady_clock::now() - start).count();
  std::this_thread::sleep_for(milliseconds(1100));
  SendBadHeader(daemon.port(), "last");
  ASSERT_TRUE(daemon.WaitForLine("last", seconds(10)).has_value());
  int of_grpc = 0;
  int64_t left_out = 0;
  for (const std::string& line : daemon.Log()) {
    const auto json = nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false);
    ASSERT_FALSE(json.is_discarded()) << line;
    EXPECT_NE(json["event"], "job") << line;
    EXPECT_EQ(line.find('\x1b'), std::string::npos);
    of_grpc += json["event"] == "library" && json["library"] == "grpc" ? 1 : 0;
    left_out += std::stoll(json.value("left_out", "0"));
  }
  EXPECT_GE(of_grpc, 3);
  EXPECT_LT(of_grpc, 10 * (1 + attacked));
  EXPECT_EQ(of_grpc + left_out, 63) << "each was written or counted";
}

TEST(Log, TextIsEscapedToo) {
  DaemonProcess daemon({"--log", "text"});
  SendBadHeader(daemon.port(), "x\nFORGED");
  const auto line = daemon.WaitForLine("FORGED", seconds(10));
  ASSERT_TRUE(line.has_value());
  EXPECT_THAT(*line, testing::HasSubstr(" library library=\"grpc\""));
}

// Lines until the pipe, the queue of the log and what was left out are full.
TEST(Log, AStalledReaderStopsNothing) {
  DaemonProcess daemon;
  daemon.StallLog(true);
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const PointCloud too_few = SphereScan(3);
  const CallOptions soon{.timeout = seconds(5), .stop = {}};
  for (int i = 0; i < 6000; ++i) {
    const absl::Status refused = client.Reconstruct(too_few, {}, {}, soon).status();
    ASSERT_EQ(refused.code(), absl::StatusCode::kInvalidArgument) << i << ": " << refused;
  }
  EXPECT_TRUE(client.Reconstruct(SphereScan(2'000), {}, {}, soon).ok());
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--probe", daemon.address()}), 0);
  daemon.Signal(SIGTERM);
  EXPECT_EQ(daemon.WaitForExit(seconds(5)), 0);
}

}  // namespace
}  // namespace rilievo
