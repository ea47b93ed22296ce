#include "server/s3/s3_place.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace rilievo {
namespace {

constexpr char kScheme[] = "s3:";
constexpr char kForm[] = "; give s3://BUCKET[/PREFIX][?endpoint=URL&region=NAME]";

absl::Status Wrong(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("blobs: ", what, kForm));
}

// Letters, digits and these: nothing that a URL or a signature would have to encode.
bool IsPlain(const std::string& text, std::string_view besides) {
  return std::all_of(text.begin(), text.end(), [&](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
           besides.find(c) != std::string_view::npos;
  });
}

std::string DefaultRegion() {
  for (const char* name : {"AWS_REGION", "AWS_DEFAULT_REGION"}) {
    const char* const region = std::getenv(name);
    if (region != nullptr && *region != '\0') return region;
  }
  return "us-east-1";
}

bool IsEndpoint(const std::string& endpoint) {
  for (const std::string scheme : {"https://", "http://"}) {
    if (!absl::StartsWith(endpoint, scheme)) continue;
    const std::string host = endpoint.substr(scheme.size());
    return !host.empty() && IsPlain(host, ".-:[]");
  }
  return false;
}

}  // namespace

bool IsS3Url(const std::string& blobs) { return absl::StartsWith(blobs, kScheme); }

absl::StatusOr<S3Place> ParseS3Url(const std::string& url) {
  S3Place place;
  const std::vector<std::string> halves = absl::StrSplit(url, absl::MaxSplits('?', 1));
  if (!absl::StartsWith(halves[0], "s3://")) return Wrong("this is not a URL of S3");
  const std::vector<std::string> path =
      absl::StrSplit(halves[0].substr(sizeof("s3://") - 1), absl::MaxSplits('/', 1));
  place.bucket = path[0];
  if (place.bucket.size() < 3 || place.bucket.size() > 63 || !IsPlain(place.bucket, ".-")) {
    return Wrong("a bucket's name has 3 to 63 letters, digits, '.' and '-'");
  }
  if (path.size() == 2 && !path[1].empty()) {
    place.prefix = absl::StrCat(absl::StripSuffix(path[1], "/"), "/");
    if (!IsPlain(place.prefix, "/._-") || absl::StrContains("/" + place.prefix, "//") ||
        absl::StrContains("/" + place.prefix, "/.")) {
      return Wrong("the prefix holds letters, digits, '.', '-', '_' and single '/'");
    }
  }
  for (const auto& option :
       absl::StrSplit(halves.size() == 2 ? halves[1] : "", '&', absl::SkipEmpty())) {
    const std::vector<std::string> words = absl::StrSplit(option, absl::MaxSplits('=', 1));
    if (words.size() == 2 && words[0] == "endpoint") {
      place.endpoint = std::string(absl::StripSuffix(words[1], "/"));
      if (!IsEndpoint(place.endpoint)) return Wrong("endpoint is not http(s)://HOST[:PORT]");
    } else if (words.size() == 2 && words[0] == "region") {
      place.region = words[1];
    } else {
      return Wrong(
          "it has an option that is neither endpoint nor region; keys and secrets are "
          "read from the environment or a file, never from the command line");
    }
  }
  if (place.region.empty()) place.region = DefaultRegion();
  if (!IsPlain(place.region, "-_")) return Wrong("region holds letters, digits, '-' and '_'");
  if (place.endpoint.empty()) {
    place.endpoint = absl::StrCat("https://s3.", place.region, ".amazonaws.com");
  }
  return place;
}

}  // namespace rilievo
