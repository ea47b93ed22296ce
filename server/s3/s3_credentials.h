// By what an S3 store knows this process.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace rilievo {

struct S3Credentials {
  std::string key_id, secret;
  std::string token;  // of a session; empty without one
};

// As Amazon's own tools find them: AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN;
// without these the section AWS_PROFILE ("default") of CredentialsFile(). UNAVAILABLE when there
// are none, with what was looked at. The file is read at each call: short-lived ones may be renewed
// in it.
absl::StatusOr<S3Credentials> ReadS3Credentials();

// AWS_SHARED_CREDENTIALS_FILE, else ~/.aws/credentials; empty where there is no home.
std::string S3CredentialsFile();

}  // namespace rilievo
