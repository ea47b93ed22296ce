// What is about objects; the rest is in store/blob_store_test.cc.
#include "server/s3/s3_blobs.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_schema.h"
#include "server/store/content_name.h"
#include "tests/unit/server/postgres/test_postgres.h"
#include "tests/unit/server/s3/scripted_s3.h"
#include "tests/unit/server/s3/test_s3.h"

namespace rilievo {
namespace {

class S3BlobsTest : public testing::Test {
 protected:
  void SetUp() override {
    RILIEVO_TEST_POSTGRES(postgres);
    RILIEVO_TEST_S3(s3);
    place_ = *ParseS3Url(s3->NewUrl());
    url_ = postgres->NewDatabase();
    database_ = std::make_unique<PostgresDatabase>(url_);
    ASSERT_TRUE(MakePostgresTables(database_.get()).ok());
    OpenBlobs();
  }

  void OpenBlobs(std::string scratch = {}) {
    std::vector<std::unique_ptr<Database>> one;
    one.push_back(std::make_unique<PostgresDatabase>(url_));
    auto opened = S3Blobs::Open(std::make_shared<LeasePool<Database>>(std::move(one)), place_,
                                std::move(scratch));
    ASSERT_TRUE(opened.ok()) << opened.status();
    blobs_ = *std::move(opened);
  }

  int64_t Rows(const std::string& where) {
    return *database_->Number("SELECT COUNT(*) FROM objects WHERE " + where);
  }
  std::string Key() {
    auto query = *database_->Prepare("SELECT key FROM objects");
    EXPECT_TRUE(*query.Step());
    return query.Bytes(0);
  }
  absl::Status Get(const std::string& key) {
    return S3Bucket(place_).Get(key, FileDescriptor(memfd_create("object", MFD_CLOEXEC)));
  }
  void LetTimePass() {
    ASSERT_TRUE(database_
                    ->Execute("UPDATE objects SET remove_after = now() - interval '1 second'"
                              " WHERE remove_after IS NOT NULL")
                    .ok());
  }

  S3Place place_;
  std::string url_;  // of the database
  std::unique_ptr<PostgresDatabase> database_;
  std::unique_ptr<S3Blobs> blobs_;
};

TEST_F(S3BlobsTest, WhatIsRemovedGoesFromTheBucketLater) {
  const std::string name = *blobs_->Put({{'a'}});
  const std::string key = Key();
  ASSERT_TRUE(blobs_->Remove(name).ok());
  ASSERT_TRUE(blobs_->Sweep().ok());
  EXPECT_TRUE(Get(key).ok()) << "somebody may be about to read it";
  EXPECT_EQ(*blobs_->Put({{'a'}}), name) << "another object";
  LetTimePass();
  ASSERT_TRUE(blobs_->Sweep().ok());
  EXPECT_TRUE(absl::IsNotFound(Get(key)));
  EXPECT_EQ(Rows("true"), 1);
  EXPECT_EQ(*blobs_->BytesOf(name), 1);
}

TEST_F(S3BlobsTest, WhatWasBegunAndNeverAdoptedGoesToo) {
  {
    const auto staged = blobs_->Stage({{'a'}});
    ASSERT_TRUE(staged.ok()) << staged.status();
    EXPECT_EQ(Rows("name IS NULL AND remove_after > now() + interval '23 hours'"), 1);
  }
  // Breaks off after the first part of several.
  const std::string piece(9 << 20, 'b');
  int pieces = 0;
  const auto broken = blobs_->StageFrom([&]() -> absl::StatusOr<std::string_view> {
    if (++pieces > 2) return absl::UnknownError("no more");
    return piece;
  });
  EXPECT_FALSE(broken.ok());
  EXPECT_EQ(Rows("length(upload) > 0"), 1);
  LetTimePass();
  ASSERT_TRUE(blobs_->Sweep().ok());
  EXPECT_EQ(Rows("true"), 0);
}

TEST_F(S3BlobsTest, ASlowStoreIsAskedForSeveralRemovalsAtATime) {
  const ScriptedS3 slow({}, {204}, std::chrono::milliseconds(100));
  place_ = *ParseS3Url(slow.url());
  OpenBlobs();
  ASSERT_TRUE(
      database_
          ->Execute("INSERT INTO objects(key, remove_after) SELECT convert_to('k' || i, 'UTF8'),"
                    " now() - interval '1 minute' FROM generate_series(1, 100) AS i")
          .ok());
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(blobs_->Sweep().ok());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(4)) << "10 one by one";
  EXPECT_EQ(Rows("true"), 0);
}

TEST_F(S3BlobsTest, WhatCouldNotBeRemovedIsTriedAgain) {
  const ScriptedS3 refusing({{200}, {204}}, S3Answer::Error(403, "AccessDenied"));
  place_ = *ParseS3Url(refusing.url());
  OpenBlobs();
  ASSERT_TRUE(database_
                  ->Execute("INSERT INTO objects(key, remove_after) VALUES('k', now() - interval"
                            " '1 minute')")
                  .ok());
  EXPECT_TRUE(absl::IsUnavailable(blobs_->Sweep()));
  EXPECT_EQ(Rows("remove_after < now() + interval '2 minutes'"), 1);
}

TEST_F(S3BlobsTest, OfTheSameBytesTwiceOneObjectStays) {
  const auto first = *blobs_->Stage({{'a'}});
  const auto second = *blobs_->Stage({{'a'}});
  ASSERT_TRUE(first->Adopt(nullptr).ok());
  ASSERT_TRUE(second->Adopt(nullptr).ok());
  EXPECT_EQ(Rows("name IS NOT NULL"), 1);
  EXPECT_EQ(blobs_->List()->size(), 1u);
}

TEST_F(S3BlobsTest, ARowThatTheDatabaseLostIsNoBlob) {
  const auto staged = *blobs_->Stage({{'a'}});
  ASSERT_TRUE(database_->Execute("DELETE FROM objects").ok());
  EXPECT_TRUE(absl::IsUnavailable(staged->Adopt(nullptr)));
}

TEST_F(S3BlobsTest, AnObjectThatIsLostIsNotFound) {
  const std::string name = *blobs_->Put({{'a'}});
  ASSERT_TRUE(S3Bucket(place_).Remove(Key()).ok());
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read(name).status()));
}

TEST_F(S3BlobsTest, AScratchFolderThatIsGoneIsNotSaidOfTheBlob) {
  const std::string name = *blobs_->Put({{'a'}});
  OpenBlobs("/nonexistent");
  EXPECT_TRUE(absl::IsUnavailable(blobs_->Read(name).status()));
}

TEST_F(S3BlobsTest, OneThatIsSetAsideIsKeptForAWeekUnderItsName) {
  const std::string name = *blobs_->Put({{'a'}});
  ASSERT_TRUE(blobs_->SetAside(name).ok());
  EXPECT_EQ(Rows("was = '" + name + "' AND remove_after > now() + interval '6 days'"), 1);
}

}  // namespace
}  // namespace rilievo
