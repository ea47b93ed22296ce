// Against a real S3 store, which checks each signature.
#include "server/s3/s3_bucket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <chrono>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "tests/unit/server/s3/test_s3.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class S3BucketTest : public testing::Test {
 protected:
  void SetUp() override {
    RILIEVO_TEST_S3(server);
    url_ = server->NewUrl();
    bucket_ = std::make_unique<S3Bucket>(*ParseS3Url(url_));
  }
  void TearDown() override { TestS3::UseCredentials(); }

  // Of another place than the test's.
  S3Bucket Changed(const std::string& what, const std::string& to) const {
    return {*ParseS3Url(absl::StrReplaceAll(url_, {{what, to}})),
            {.retry = std::chrono::seconds(2), .stall = std::chrono::seconds(1)}};
  }

  static std::string Contents(const S3Bucket& bucket, const std::string& key) {
    const FileDescriptor file(memfd_create("object", MFD_CLOEXEC));
    EXPECT_TRUE(file.Write("what was there before", 21).ok());
    const absl::Status got = bucket.Get(key, file);
    EXPECT_TRUE(got.ok()) << got;
    std::string bytes(static_cast<size_t>(*file.Size()), '\0');
    EXPECT_TRUE(file.ReadAt(0, bytes.data(), bytes.size()).ok());
    return bytes;
  }

  bool IsMissing(const std::string& key) const {
    return absl::IsNotFound(bucket_->Get(key, FileDescriptor(memfd_create("object", MFD_CLOEXEC))));
  }

  std::string url_;
  std::unique_ptr<S3Bucket> bucket_;
};

TEST_F(S3BucketTest, KeepsWhatIsPut) {
  const std::string bytes(3'000'000, '\x07');
  ASSERT_TRUE(bucket_->Put("a", bytes).ok());
  EXPECT_EQ(Contents(*bucket_, "a"), bytes);
  ASSERT_TRUE(bucket_->Put("a", "").ok()) << "one without bytes, over the other";
  EXPECT_EQ(Contents(*bucket_, "a"), "");
  EXPECT_TRUE(bucket_->Remove("a").ok());
  EXPECT_TRUE(bucket_->Remove("a").ok());
  EXPECT_TRUE(IsMissing("a"));
}

TEST_F(S3BucketTest, PartsAreAnObjectAtTheEnd) {
  const auto upload = bucket_->BeginParts("p");
  ASSERT_TRUE(upload.ok()) << upload.status();
  const std::string large(5 << 20, 'a');
  const auto first = bucket_->PutPart("p", *upload, 1, large);
  ASSERT_TRUE(first.ok()) << first.status();
  const auto second = bucket_->PutPart("p", *upload, 2, "b");
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_TRUE(IsMissing("p"));
  const absl::Status ended = bucket_->EndParts("p", *upload, {*first, *second});
  ASSERT_TRUE(ended.ok()) << ended;
  EXPECT_EQ(Contents(*bucket_, "p"), large + "b");
  EXPECT_TRUE(bucket_->Remove("p").ok());

  const auto given_up = bucket_->BeginParts("p");
  ASSERT_TRUE(bucket_->PutPart("p", *given_up, 1, "c").ok());
  EXPECT_TRUE(bucket_->DropParts("p", *given_up).ok());
  EXPECT_TRUE(bucket_->DropParts("p", *given_up).ok());
  EXPECT_FALSE(bucket_->PutPart("p", *given_up, 2, "d").ok());
}

TEST_F(S3BucketTest, WrongSettingsAreTheOperatorsToMend) {
  EXPECT_THAT(Changed("//rilievo", "//other-one").Put("a", "x").message(),
              HasSubstr("NoSuchBucket: make the bucket"));
  EXPECT_THAT(Changed("?", "?region=eu-west-9&").Put("a", "x").message(), HasSubstr("check"));
  setenv("AWS_SECRET_ACCESS_KEY", "wrong", 1);
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status refused = bucket_->Put("a", "x");
  EXPECT_TRUE(absl::IsUnavailable(refused));
  EXPECT_THAT(refused.message(), HasSubstr("403 SignatureDoesNotMatch: check the credentials"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10))
      << "nothing that passes by itself";
  unsetenv("AWS_SECRET_ACCESS_KEY");
  EXPECT_TRUE(absl::IsUnavailable(bucket_->Put("a", "x")));
}

TEST_F(S3BucketTest, OneThatIsAwayIsTriedForAWhile) {
  const std::string port = url_.substr(url_.rfind(':'));
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status away = Changed(port, ":1").Put("a", "x");
  EXPECT_TRUE(absl::IsUnavailable(away));
  EXPECT_THAT(away.message(), HasSubstr("http://127.0.0.1:1: "));
  const auto taken = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(taken, std::chrono::seconds(1));
  EXPECT_LT(taken, std::chrono::seconds(5));
}

TEST_F(S3BucketTest, OneThatSaysNothingIsGivenUp) {
  const FileDescriptor listener(socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  ASSERT_EQ(bind(listener.number(), reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(listener.number(), 5), 0);
  ASSERT_EQ(getsockname(listener.number(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  const std::string port = url_.substr(url_.rfind(':'));
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status silent =
      Changed(port, absl::StrCat(":", ntohs(address.sin_port))).Put("a", "x");
  EXPECT_TRUE(absl::IsUnavailable(silent)) << silent;
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(12));
}

}  // namespace
}  // namespace rilievo
