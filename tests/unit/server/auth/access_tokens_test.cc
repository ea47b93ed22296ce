#include "server/auth/access_tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

TEST(AccessTokens, KnowsItsOwnTokensByName) {
  const auto alice = MakeToken("alice"), bob = MakeToken("bob-2");
  ASSERT_TRUE(alice.ok() && bob.ok());
  const auto tokens =
      AccessTokens::Parse(absl::StrCat("# ours\n\n", alice->line, "\r\n", bob->line));
  ASSERT_TRUE(tokens.ok()) << tokens.status();
  EXPECT_EQ(tokens->OwnerOf(alice->token), "alice");
  EXPECT_EQ(tokens->OwnerOf(bob->token), "bob-2");
}

TEST(AccessTokens, EveryOtherStringIsNone) {
  const auto made = MakeToken("alice");
  const auto tokens = AccessTokens::Parse(made->line);
  for (size_t i = 0; i < made->token.size(); ++i) {
    std::string changed = made->token;
    changed[i] = changed[i] == 'A' ? 'B' : 'A';
    EXPECT_FALSE(tokens->OwnerOf(changed).has_value()) << i;
    EXPECT_FALSE(tokens->OwnerOf(made->token.substr(0, i)).has_value()) << i;
  }
  EXPECT_FALSE(tokens->OwnerOf(made->token + "A").has_value());
  EXPECT_FALSE(tokens->OwnerOf(MakeToken("alice")->token).has_value()) << "another of that name";
  EXPECT_FALSE(tokens->OwnerOf(made->line).has_value());
  EXPECT_FALSE(AccessTokens::Parse("")->OwnerOf("").has_value());
}

TEST(AccessTokens, TheFileHoldsNoSecret) {
  const auto made = MakeToken("alice"), again = MakeToken("alice");
  const std::string secret = made->token.substr(made->token.find('.') + 1);
  EXPECT_EQ(secret.size(), 43u) << "256 bits in base64url";
  EXPECT_THAT(made->line, testing::Not(HasSubstr(secret)));
  EXPECT_NE(made->token, again->token);
}

TEST(AccessTokens, OneNameMayHaveTwoWhileTheyChange) {
  const auto old_token = MakeToken("alice"), new_token = MakeToken("alice");
  const auto tokens = AccessTokens::Parse(absl::StrCat(old_token->line, "\n", new_token->line));
  EXPECT_EQ(tokens->OwnerOf(old_token->token), "alice");
  EXPECT_EQ(tokens->OwnerOf(new_token->token), "alice");
}

TEST(AccessTokens, WrongLinesAreNamed) {
  const std::string line = MakeToken("a")->line;
  for (const std::string& wrong :
       {std::string("a"), std::string("a md5:00:00"), line + " x", line.substr(0, line.size() - 1),
        line + "0", "b/c" + line.substr(1)}) {
    const auto tokens = AccessTokens::Parse(line + "\n" + wrong);
    EXPECT_THAT(std::string(tokens.status().message()), HasSubstr("line 2")) << wrong;
  }
}

TEST(AccessTokens, NamesAreWords) {
  for (const std::string& name : std::vector<std::string>{"", "a b", "a.b", "a/b", "ü"}) {
    EXPECT_EQ(MakeToken(name).status().code(), absl::StatusCode::kInvalidArgument) << name;
  }
  EXPECT_FALSE(MakeToken(std::string(65, 'a')).ok());
  EXPECT_TRUE(MakeToken(std::string(64, 'a')).ok());
}

}  // namespace
}  // namespace rilievo
