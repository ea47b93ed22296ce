// An S3 store of the test program alone: OpenStack Swift (tests/fleet/swift_s3.py) on a port of
// loopback, with its files in a temporary folder. It ends with the program.
#pragma once

#include <memory>
#include <string>

#include "server/s3/s3_place.h"

namespace rilievo {

class TestS3 {
 public:
  // Started when it is first asked for; the environment then has its credentials. Null where
  // Debian's python3-swift is not installed or does not start; `why_not` says so then.
  static TestS3* Get(std::string* why_not);

  // Of a prefix that nobody has used.
  std::string NewUrl();

  // The credentials, into the environment.
  static void UseCredentials();

  ~TestS3();

 private:
  explicit TestS3(std::string folder) : folder_(std::move(folder)) {}

  bool Launch();

  const std::string folder_;
  int server_ = -1;
  std::string port_;
  int prefixes_ = 0;
};

}  // namespace rilievo

// In the body of a test or of SetUp(): `server` is a TestS3*, or the test is skipped.
#define RILIEVO_TEST_S3(server)                          \
  std::string server##_why_not;                          \
  TestS3* const server = TestS3::Get(&server##_why_not); \
  if (server == nullptr) GTEST_SKIP() << server##_why_not
