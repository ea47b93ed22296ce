#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "grpcpp/server.h"
#include "server/observability/port/channelz_port.h"
#include "server/observability/port/metrics_port.h"
#include "server/observability/server_metrics.h"
#include "tests/unit/server/os/loopback.h"

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(MetricsPort, TakesAFreePortAndRefusesOneThatIsTaken) {
  const ServerMetrics metrics;
  const auto port = MetricsPort::Open("127.0.0.1:0", metrics.collectable());
  ASSERT_TRUE(port.ok()) << port.status();
  EXPECT_NE((*port)->address(), "127.0.0.1:0");
  EXPECT_TRUE(
      absl::IsUnavailable(MetricsPort::Open((*port)->address(), metrics.collectable()).status()));
  EXPECT_TRUE(absl::IsUnavailable(MetricsPort::Open("nonsense", metrics.collectable()).status()));
}

FileDescriptor ConnectToAddress(const std::string& address) {
  return ConnectTo(std::stoi(address.substr(address.rfind(':') + 1)));
}

// The whole answer; empty when the connection is closed without one.
std::string Ask(const FileDescriptor& connection, const std::string& request) {
  EXPECT_TRUE(connection.Send(request.data(), request.size()).ok());
  std::string answer;
  char c;
  while (connection.Read(&c, 1).ok()) answer += c;
  return answer;
}

TEST(MetricsPort, AnswersBesideConnectionsThatSayNothing) {
  const ServerMetrics metrics;
  const auto port = MetricsPort::Open("127.0.0.1:0", metrics.collectable());
  ASSERT_TRUE(port.ok()) << port.status();
  std::vector<FileDescriptor> silent;
  for (int i = 0; i < 50; ++i) {
    silent.push_back(ConnectToAddress((*port)->address()));
    const std::string begun = "GET /metrics HTTP/1.1\r\nX-A: ";
    EXPECT_TRUE(silent.back().Send(begun.data(), begun.size()).ok());
  }
  const auto start = std::chrono::steady_clock::now();
  const std::string answer =
      Ask(ConnectToAddress((*port)->address()), "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK\r\n"));
  const size_t body = answer.find("\r\n\r\n") + 4;
  EXPECT_THAT(answer.substr(body), HasSubstr("rilievo_connections 0\n"));
  EXPECT_THAT(answer, HasSubstr("Content-Length: " + std::to_string(answer.size() - body)));
  EXPECT_THAT(Ask(silent.front(), "x\r\n\r\n"), HasSubstr("rilievo_connections"))
      << "slow is not too late";
}

TEST(MetricsPort, ClosesWhoIsTooManyOrTooLong) {
  const ServerMetrics metrics;
  const auto port = MetricsPort::Open("127.0.0.1:0", metrics.collectable());
  ASSERT_TRUE(port.ok()) << port.status();
  std::vector<FileDescriptor> silent;
  for (size_t i = 0; i < ScrapeServer::kMostConnections + 1; ++i) {
    silent.push_back(ConnectToAddress((*port)->address()));
  }
  EXPECT_EQ(Ask(silent[0], ""), "") << "the oldest made room";
  EXPECT_THAT(Ask(silent[1], "GET / HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask(silent[2], "POST /metrics HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 405"));
  EXPECT_EQ(Ask(silent[3], std::string(20'000, 'x')), "") << "no request is so long";
}

TEST(ChannelzPort, IsForThisMachineAlone) {
  std::string bound;
  EXPECT_EQ(OpenChannelzPort("0.0.0.0:0", &bound).status().code(),
            absl::StatusCode::kInvalidArgument);
  const auto server = OpenChannelzPort("127.0.0.1:0", &bound);
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_NE(bound, "127.0.0.1:0");
  EXPECT_TRUE(absl::IsUnavailable(OpenChannelzPort(bound, &bound).status()));
}

}  // namespace
}  // namespace rilievo
