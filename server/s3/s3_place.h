// Where in an S3 store a fleet's blobs are.
#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace rilievo {

struct S3Place {
  std::string endpoint;  // scheme, host, port: "https://s3.example.org:9000"
  std::string bucket;
  std::string prefix;  // of all keys; empty, or ends in '/'
  std::string region;  // that signatures name
};

// Whether blobs are named so: "s3:...".
bool IsS3Url(const std::string& blobs);

// Reads s3://BUCKET[/PREFIX][?endpoint=URL][&region=NAME]. The region is by default that of
// AWS_REGION or AWS_DEFAULT_REGION, else us-east-1, the endpoint Amazon's of that region. The URL
// is addressed by path: ENDPOINT/BUCKET/PREFIX/KEY. INVALID_ARGUMENT names what is wrong, and
// repeats nothing that could be a secret.
absl::StatusOr<S3Place> ParseS3Url(const std::string& url);

}  // namespace rilievo
