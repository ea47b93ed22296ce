#include <gtest/gtest.h>

#include "grpcpp/server.h"
#include "server/observability/port/channelz_port.h"
#include "server/observability/port/metrics_port.h"
#include "server/observability/server_metrics.h"

namespace rilievo {
namespace {

TEST(MetricsPort, TakesAFreePortAndRefusesOneThatIsTaken) {
  const ServerMetrics metrics;
  const auto port = MetricsPort::Open("127.0.0.1:0", metrics.collectable());
  ASSERT_TRUE(port.ok()) << port.status();
  EXPECT_NE((*port)->address(), "127.0.0.1:0");
  EXPECT_TRUE(
      absl::IsUnavailable(MetricsPort::Open((*port)->address(), metrics.collectable()).status()));
  EXPECT_TRUE(absl::IsUnavailable(MetricsPort::Open("nonsense", metrics.collectable()).status()));
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
