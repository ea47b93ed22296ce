#include "server/s3/s3_credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <map>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

constexpr const char* kVariables[] = {"AWS_ACCESS_KEY_ID",
                                      "AWS_SECRET_ACCESS_KEY",
                                      "AWS_SESSION_TOKEN",
                                      "AWS_PROFILE",
                                      "HOME",
                                      "AWS_SHARED_CREDENTIALS_FILE"};

// The environment is as before afterwards.
class S3CredentialsTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : kVariables) {
      if (const char* value = getenv(name)) before_[name] = value;
      unsetenv(name);
    }
  }
  void TearDown() override {
    for (const char* name : kVariables) {
      unsetenv(name);
      if (before_.contains(name)) setenv(name, before_[name].c_str(), 1);
    }
  }

  std::string File(const std::string& text) {
    std::ofstream(test_ / "credentials") << text;
    return test_ / "credentials";
  }

  TestFolder test_;
  std::map<std::string, std::string> before_;
};

TEST_F(S3CredentialsTest, TheEnvironmentComesFirst) {
  setenv("AWS_SHARED_CREDENTIALS_FILE",
         File("[default]\naws_access_key_id=f\naws_secret_access_key=g\n").c_str(), 1);
  setenv("AWS_ACCESS_KEY_ID", "k", 1);
  setenv("AWS_SECRET_ACCESS_KEY", "s", 1);
  setenv("AWS_SESSION_TOKEN", "t", 1);
  const auto found = ReadS3Credentials();
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->key_id, "k");
  EXPECT_EQ(found->secret, "s");
  EXPECT_EQ(found->token, "t");
}

TEST_F(S3CredentialsTest, TheFileHasAProfileAndIsReadAnew) {
  const std::string path = File(
      "# of the fleet\n[default]\naws_access_key_id = a\naws_secret_access_key = b=c\n\n"
      "[ other ]\naws_access_key_id = no\n[other]\naws_access_key_id = x\n"
      "aws_secret_access_key = y\naws_session_token = z\n");
  setenv("AWS_SHARED_CREDENTIALS_FILE", path.c_str(), 1);
  EXPECT_EQ(ReadS3Credentials()->key_id, "a");
  EXPECT_EQ(ReadS3Credentials()->secret, "b=c");
  EXPECT_EQ(ReadS3Credentials()->token, "");
  setenv("AWS_PROFILE", "other", 1);
  EXPECT_EQ(ReadS3Credentials()->key_id, "x");
  EXPECT_EQ(ReadS3Credentials()->token, "z");
  File("[other]\naws_access_key_id = renewed\naws_secret_access_key = y\n");
  EXPECT_EQ(ReadS3Credentials()->key_id, "renewed");
}

TEST_F(S3CredentialsTest, WithoutAnyItSaysWhereItLooked) {
  setenv("HOME", (test_ / "home").c_str(), 1);
  const auto none = ReadS3Credentials();
  EXPECT_TRUE(absl::IsUnavailable(none.status()));
  EXPECT_THAT(none.status().message(), ::testing::HasSubstr("home/.aws/credentials"));
  EXPECT_THAT(none.status().message(), ::testing::HasSubstr("AWS_ACCESS_KEY_ID"));
}

}  // namespace
}  // namespace rilievo
