// With real certificates and connections: tests/integration/auth.
#include "server/auth/server_credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grpcpp/security/server_credentials.h"

namespace rilievo {
namespace {

TEST(ServerCredentials, PlaintextOnlyWhereNobodyCanListenIn) {
  ServerOptions options;
  for (const char* local : {"127.0.0.1:0", "[::1]:0", "localhost:1", "unix:/x"}) {
    options.listen = local;
    EXPECT_TRUE(MakeServerCredentials(options).ok()) << local;
  }
  for (const char* open : {"0.0.0.0:0", "[::]:0", "10.1.2.3:1", "host.example:1", ":1"}) {
    options.listen = open;
    options.allow_plaintext = false;
    EXPECT_EQ(MakeServerCredentials(options).status().code(), absl::StatusCode::kInvalidArgument);
    options.allow_plaintext = true;
    EXPECT_TRUE(MakeServerCredentials(options).ok()) << open;
  }
}

TEST(ServerCredentials, FilesThatCannotBeReadAreNamed) {
  ServerOptions options;
  options.tls_certificate = "/nowhere/server.pem";
  EXPECT_THAT(std::string(MakeServerCredentials(options).status().message()),
              testing::HasSubstr("--tls-key"));
  options.tls_key = "/nowhere/server.key";
  EXPECT_THAT(std::string(MakeServerCredentials(options).status().message()),
              testing::HasSubstr("/nowhere/server.pem"));
}

}  // namespace
}  // namespace rilievo
