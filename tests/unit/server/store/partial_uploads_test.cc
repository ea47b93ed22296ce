#include "server/store/partial_uploads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>

#include "server/store/blob_folder.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

class PartialUploadsTest : public testing::Test {
 protected:
  PartialUploadsTest()
      : uploads_(*PartialUploads::Open(test_ / "uploads")),
        blobs_(*BlobFolder::Open(test_ / "blobs")) {
    std::mt19937 random(5);
    for (int i = 0; i < 300'000; ++i) scan_ += static_cast<char>(random());
  }

  // Appends scan_[offset, end) in pieces.
  void Append(PartialUploads::Writer* writer, size_t end, size_t piece = 4096) {
    for (auto at = static_cast<size_t>(writer->size()); at < end; at += piece) {
      ASSERT_TRUE(writer->Append(scan_.substr(at, std::min(piece, end - at))).ok());
    }
  }

  absl::Status Finish(PartialUploads::Writer* writer) {
    return writer->Finish(static_cast<int64_t>(scan_.size()), ContentNameOf(scan_),
                          [&](const std::string& path, const FileDescriptor& file) {
                            return blobs_.Adopt(path, file, ContentNameOf(scan_));
                          });
  }

  TestFolder test_;
  std::unique_ptr<PartialUploads> uploads_;
  BlobFolder blobs_;
  std::string scan_;
};

TEST_F(PartialUploadsTest, CutAnywhereAndResumedItIsWhole) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    const size_t cut = random() % scan_.size();
    {
      auto writer = uploads_->Continue("a", 0);
      ASSERT_TRUE(writer.ok()) << writer.status();
      Append(&*writer, cut);
    }
    const auto stored = uploads_->StoredBytes("a");
    ASSERT_EQ(*stored, static_cast<int64_t>(cut));
    // From where it was cut, or from a little before, by a server that has started anew.
    uploads_ = *PartialUploads::Open(test_ / "uploads");
    const auto from = static_cast<int64_t>(round % 2 == 0 ? cut : random() % (cut + 1));
    auto writer = uploads_->Continue("a", from);
    ASSERT_TRUE(writer.ok()) << writer.status();
    EXPECT_EQ(writer->size(), from);
    Append(&*writer, scan_.size());
    ASSERT_TRUE(Finish(&*writer).ok());
    EXPECT_TRUE(blobs_.Read(ContentNameOf(scan_)).ok());
    EXPECT_EQ(*uploads_->StoredBytes("a"), 0);
  }
}

TEST_F(PartialUploadsTest, ACutUploadIsNeverTakenForAWholeOne) {
  auto writer = uploads_->Continue("a", 0);
  Append(&*writer, scan_.size() - 1);
  EXPECT_EQ(Finish(&*writer).code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(blobs_.List()->empty());
  EXPECT_EQ(*uploads_->StoredBytes("a"), 0) << "it begins again";
}

TEST_F(PartialUploadsTest, DamageOnDiskIsNoticed) {
  {
    auto writer = uploads_->Continue("a", 0);
    Append(&*writer, 200'000);
  }
  std::fstream file(test_ / "uploads/a", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(1000);
  file.put(static_cast<char>(scan_[1000] ^ 1));
  file.close();
  auto writer = uploads_->Continue("a", 200'000);
  Append(&*writer, scan_.size());
  EXPECT_EQ(Finish(&*writer).code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(blobs_.List()->empty());
}

TEST_F(PartialUploadsTest, AnOffsetBeyondWhatIsStoredIsRefused) {
  EXPECT_EQ(uploads_->Continue("a", 1).status().code(), absl::StatusCode::kOutOfRange);
}

TEST_F(PartialUploadsTest, TheLatestWriterWins) {
  auto first = uploads_->Continue("a", 0);
  Append(&*first, 5000);
  auto second = uploads_->Continue("a", 5000);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(first->Append("late").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Finish(&*first).code(), absl::StatusCode::kAborted);
  Append(&*second, scan_.size());
  EXPECT_TRUE(Finish(&*second).ok());
}

TEST_F(PartialUploadsTest, OneThatNobodyWritesIsRemoved) {
  {
    auto writer = uploads_->Continue("a", 0);
    Append(&*writer, 5000);
    EXPECT_FALSE(*uploads_->RemoveIfIdle("a")) << "somebody is at it";
  }
  EXPECT_TRUE(*uploads_->RemoveIfIdle("a"));
  EXPECT_EQ(*uploads_->StoredBytes("a"), 0);
}

// Whoever asks to go on costs the server no reading of what is stored.
TEST_F(PartialUploadsTest, GoingOnReadsNothing) {
  {
    auto writer = uploads_->Continue("a", 0);
    ASSERT_TRUE(writer->Append(std::string(64 << 20, 'x')).ok());
  }
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(uploads_->Continue("a", 64 << 20).ok());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

}  // namespace
}  // namespace rilievo
