// What is made of answers that a real store seldom gives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <chrono>

#include "server/s3/s3_bucket.h"
#include "tests/unit/server/s3/scripted_s3.h"
#include "tests/unit/server/s3/test_s3.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;

class S3AnswersTest : public testing::Test {
 protected:
  S3AnswersTest() { TestS3::UseCredentials(); }

  static S3Bucket BucketOf(const ScriptedS3& store) {
    return {*ParseS3Url(store.url()),
            {.retry = std::chrono::seconds(1), .stall = std::chrono::seconds(1)}};
  }
  static absl::Status Get(const ScriptedS3& store, const std::function<void()>& moved = {}) {
    return BucketOf(store).Get("k", FileDescriptor(memfd_create("object", MFD_CLOEXEC)), moved);
  }
};

TEST_F(S3AnswersTest, GoneIsWhatTheStoreCallsSo) {
  const ScriptedS3 gone({S3Answer::Error(404, "NoSuchKey")});
  EXPECT_TRUE(absl::IsNotFound(Get(gone)));
  EXPECT_THAT(gone.requests(), ElementsAre("GET /bucket/k")) << "nothing that passes by itself";
  EXPECT_TRUE(BucketOf(ScriptedS3({S3Answer::Error(404, "NoSuchKey")})).Remove("k").ok());
}

TEST_F(S3AnswersTest, APagesNotFoundIsNoAnswerOfTheStore) {
  const ScriptedS3 proxy({}, {404, "<html>no such page</html>"});
  EXPECT_TRUE(absl::IsUnavailable(Get(proxy)));
  EXPECT_GT(proxy.requests().size(), 1u);
  EXPECT_TRUE(absl::IsUnavailable(BucketOf(proxy).Remove("k")));
  EXPECT_TRUE(absl::IsUnavailable(BucketOf(proxy).DropParts("k", "u")));
  const ScriptedS3 for_a_moment({{404, "not yet"}});
  EXPECT_TRUE(Get(for_a_moment).ok());
}

TEST_F(S3AnswersTest, AnUploadWhoseEndWasNotHeardOfIsThere) {
  const ScriptedS3 store({{.lost = true}, S3Answer::Error(404, "NoSuchUpload"), {200}});
  EXPECT_TRUE(BucketOf(store).EndParts("k", "u", {"tag"}).ok());
  EXPECT_THAT(store.requests(), ElementsAre("POST /bucket/k?uploadId=u",
                                            "POST /bucket/k?uploadId=u", "HEAD /bucket/k"));
}

TEST_F(S3AnswersTest, AnUploadThatIsGoneWithoutAnObjectCanBeSentAgain) {
  const ScriptedS3 store({S3Answer::Error(404, "NoSuchUpload")}, {404});
  EXPECT_TRUE(absl::IsUnavailable(BucketOf(store).EndParts("k", "u", {"tag"})));
}

TEST_F(S3AnswersTest, AnErrorBehindTheBeginOfAnAnswerIsOne) {
  const ScriptedS3 store({S3Answer::Error(200, "InternalError"), {200}});
  EXPECT_TRUE(BucketOf(store).EndParts("k", "u", {"tag"}).ok());
  EXPECT_EQ(store.requests().size(), 2u);
}

TEST_F(S3AnswersTest, BytesOnTheirWayAreNoticed) {
  const ScriptedS3 store({{200, std::string(4 << 20, 'x')}});
  int moved = 0;
  EXPECT_TRUE(Get(store, [&] { ++moved; }).ok());
  EXPECT_GT(moved, 4);
}

}  // namespace
}  // namespace rilievo
