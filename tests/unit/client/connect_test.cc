#include "client/library/connect.h"

#include <gtest/gtest.h>

#include "proto/local_address.h"

namespace rilievo {
namespace {

TEST(LocalAddress, LoopbackAndSocketsOnly) {
  for (const char* local : {"127.0.0.1:50051", "127.1.2.3:1", "localhost:0", "[::1]:50051",
                            "unix:/run/rilievod", "unix-abstract:x"}) {
    EXPECT_TRUE(IsLocalAddress(local)) << local;
  }
  for (const char* remote : {"0.0.0.0:50051", "[::]:50051", "10.0.0.1:1", "127.example.org:1",
                             "host:1", ":50051", "", "1270.0.0.1:1"}) {
    EXPECT_FALSE(IsLocalAddress(remote)) << remote;
  }
}

TEST(Connect, OptionsThatDoNotGoTogetherAreRefused) {
  const auto code = [](const char* address, const ConnectOptions& options) {
    return Connect(address, options).status().code();
  };
  EXPECT_EQ(code("10.0.0.1:1", {}), absl::StatusCode::kOk);
  EXPECT_EQ(code("127.0.0.1:1", {.token = "a.b"}), absl::StatusCode::kOk);
  EXPECT_EQ(code("10.0.0.1:1", {.token = "a.b"}), absl::StatusCode::kInvalidArgument)
      << "not over a network in clear";
  EXPECT_EQ(code("10.0.0.1:1", {.token = "a.b", .allow_plaintext = true}), absl::StatusCode::kOk);
  EXPECT_EQ(code("10.0.0.1:1", {.token = "a.b", .ca = "pem"}), absl::StatusCode::kOk);
  EXPECT_EQ(code("127.0.0.1:1", {.token = "a b"}), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code("127.0.0.1:1", {.ca = "pem", .certificate = "x"}),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(code("127.0.0.1:1", {.certificate = "x", .key = "y"}),
            absl::StatusCode::kInvalidArgument);
}

TEST(Connect, SeveralAddressesAreSeveralChannels) {
  EXPECT_EQ(ConnectToEach("a:1,b:2,c:3", {})->size(), 3u);
  EXPECT_EQ(ConnectToEach("a:1", {})->size(), 1u);
  for (const char* addresses : {"", "a:1,", ",a:1", "a:1,,b:2"}) {
    EXPECT_TRUE(absl::IsInvalidArgument(ConnectToEach(addresses, {}).status())) << addresses;
  }
  EXPECT_TRUE(
      absl::IsInvalidArgument(ConnectToEach("127.0.0.1:1,10.0.0.1:1", {.token = "a.b"}).status()))
      << "one of them is on another machine";
}

}  // namespace
}  // namespace rilievo
