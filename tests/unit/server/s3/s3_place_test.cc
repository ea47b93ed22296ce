#include "server/s3/s3_place.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

namespace rilievo {
namespace {

using ::testing::HasSubstr;

TEST(S3Place, IsReadFromItsUrl) {
  const auto place =
      ParseS3Url("s3://scans/fleet/one/?endpoint=http://10.0.0.7:9000/&region=eu-central-1");
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->endpoint, "http://10.0.0.7:9000");
  EXPECT_EQ(place->bucket, "scans");
  EXPECT_EQ(place->prefix, "fleet/one/");
  EXPECT_EQ(place->region, "eu-central-1");
  EXPECT_TRUE(IsS3Url("s3://scans"));
  EXPECT_FALSE(IsS3Url("file:/s3"));
}

TEST(S3Place, IsAmazonsUnlessItSaysOtherwise) {
  unsetenv("AWS_REGION");
  unsetenv("AWS_DEFAULT_REGION");
  EXPECT_EQ(ParseS3Url("s3://scans")->endpoint, "https://s3.us-east-1.amazonaws.com");
  EXPECT_EQ(ParseS3Url("s3://scans/")->prefix, "");
  setenv("AWS_DEFAULT_REGION", "eu-west-2", 1);
  EXPECT_EQ(ParseS3Url("s3://scans")->endpoint, "https://s3.eu-west-2.amazonaws.com");
  setenv("AWS_REGION", "eu-north-1", 1);
  EXPECT_EQ(ParseS3Url("s3://scans")->region, "eu-north-1");
  unsetenv("AWS_REGION");
  unsetenv("AWS_DEFAULT_REGION");
}

TEST(S3Place, SaysWhatIsWrongAndRepeatsNoSecret) {
  for (const auto& [url, words] : std::vector<std::pair<std::string, std::string>>{
           {"s3:scans", "not a URL of S3"},
           {"s3://", "bucket's name"},
           {"s3://hunter2@scans", "bucket's name"},
           {"s3://scans/a//b", "prefix"},
           {"s3://scans/../b", "prefix"},
           {"s3://scans?endpoint=ftp://h", "endpoint"},
           {"s3://scans?endpoint=https://key:hunter2@host", "endpoint"},
           {"s3://scans?region=a/b", "region"},
           {"s3://scans?secret=hunter2", "never from the command line"}}) {
    const auto place = ParseS3Url(url);
    EXPECT_TRUE(absl::IsInvalidArgument(place.status())) << url;
    EXPECT_THAT(place.status().message(), HasSubstr(words)) << url;
    EXPECT_THAT(place.status().message(), HasSubstr("give s3://BUCKET"));
    EXPECT_THAT(place.status().message(), ::testing::Not(HasSubstr("hunter2")));
  }
}

}  // namespace
}  // namespace rilievo
