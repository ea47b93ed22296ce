// What callers see of it: tests/integration/auth.
#include "server/auth/doorkeeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grpcpp/server_context.h"
#include "server/auth/access_tokens.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(Doorkeeper, AsksForNothingUnlessTold) {
  const auto keeper = Doorkeeper::Open(ServerOptions());
  ASSERT_TRUE(keeper.ok());
  grpc::CallbackServerContext context;
  Caller caller;
  EXPECT_FALSE((*keeper)->Admit(context, &caller).has_value());
  EXPECT_EQ(caller.owner, "");
}

TEST(Doorkeeper, ACallWithoutATokenIsTold) {
  TestFolder test;
  ASSERT_TRUE(AddTokenLine(test / "tokens", MakeToken("alice")->line).ok());
  ServerOptions options;
  options.tokens = test / "tokens";
  const auto keeper = Doorkeeper::Open(options);
  ASSERT_TRUE(keeper.ok()) << keeper.status();
  grpc::CallbackServerContext context;
  Caller caller;
  const auto error = (*keeper)->Admit(context, &caller);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), absl::StatusCode::kUnauthenticated);
  EXPECT_EQ(error->reason, ErrorCause::kNoToken);
}

TEST(Doorkeeper, ATokenFileThatIsNotThereIsAnError) {
  ServerOptions options;
  options.tokens = "/nowhere/tokens";
  EXPECT_TRUE(absl::IsNotFound(Doorkeeper::Open(options).status()));
}

}  // namespace
}  // namespace rilievo
