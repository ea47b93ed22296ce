#include "server/store/scan_uploads.h"

#include <algorithm>
#include <random>

#include "server/store/content_name.h"
#include "tests/unit/server/store/bytes_fixture.h"

namespace rilievo {
namespace {

class ScanUploadsTest : public BytesTest {
 protected:
  ScanUploadsTest() {
    std::mt19937 random(5);
    for (int i = 0; i < 300'000; ++i) scan_ += static_cast<char>(random());
  }

  // Appends scan_[offset, end) in pieces.
  void Append(UploadWriter* writer, size_t end, size_t piece = 4096) {
    for (auto at = static_cast<size_t>(writer->size()); at < end; at += piece) {
      ASSERT_TRUE(writer->Append(scan_.substr(at, std::min(piece, end - at))).ok());
    }
  }

  absl::Status Finish(UploadWriter* writer) {
    return writer->Finish(static_cast<int64_t>(scan_.size()), ContentNameOf(scan_),
                          [](const StagedBlob& staged) { return staged.Adopt(nullptr); });
  }

  std::string scan_;
};

TEST_P(ScanUploadsTest, CutAnywhereAndResumedItIsWhole) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    const size_t cut = random() % scan_.size();
    {
      auto writer = uploads_->Continue("a", 0);
      ASSERT_TRUE(writer.ok()) << writer.status();
      Append(writer->get(), cut);
    }
    const auto stored = uploads_->StoredBytes("a");
    ASSERT_EQ(*stored, static_cast<int64_t>(cut));
    // From where it was cut, or from a little before, by a server that has started anew.
    Reopen();
    const auto from = static_cast<int64_t>(round % 2 == 0 ? cut : random() % (cut + 1));
    auto writer = uploads_->Continue("a", from);
    ASSERT_TRUE(writer.ok()) << writer.status();
    EXPECT_EQ((*writer)->size(), from);
    Append(writer->get(), scan_.size());
    ASSERT_TRUE(Finish(writer->get()).ok());
    EXPECT_EQ(Contents(*blobs_->Read(ContentNameOf(scan_))), scan_);
    EXPECT_EQ(*uploads_->StoredBytes("a"), 0);
  }
}

TEST_P(ScanUploadsTest, ACutUploadIsNeverTakenForAWholeOne) {
  auto writer = uploads_->Continue("a", 0);
  Append(writer->get(), scan_.size() - 1);
  EXPECT_EQ(Finish(writer->get()).code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(blobs_->List()->empty());
  EXPECT_EQ(*uploads_->StoredBytes("a"), 0) << "it begins again";
}

TEST_P(ScanUploadsTest, AnOffsetBeyondWhatIsStoredIsRefused) {
  EXPECT_EQ(uploads_->Continue("a", 1).status().code(), absl::StatusCode::kOutOfRange);
}

TEST_P(ScanUploadsTest, TheLatestWriterWins) {
  auto first = uploads_->Continue("a", 0);
  Append(first->get(), 5000);
  auto second = uploads_->Continue("a", 5000);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ((*first)->Append("late").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(Finish(first->get()).code(), absl::StatusCode::kAborted);
  Append(second->get(), scan_.size());
  EXPECT_TRUE(Finish(second->get()).ok());
}

TEST_P(ScanUploadsTest, OneThatNobodyWritesIsRemoved) {
  {
    auto writer = uploads_->Continue("a", 0);
    Append(writer->get(), 5000);
    EXPECT_FALSE(*uploads_->RemoveIfIdle("a")) << "somebody is at it";
  }
  EXPECT_TRUE(*uploads_->RemoveIfIdle("a"));
  EXPECT_EQ(*uploads_->StoredBytes("a"), 0);
}

// Whoever sends the rest need not be where it began.
TEST_P(ScanUploadsTest, WhatIsStoredIsListed) {
  auto writer = uploads_->Continue("a.b", 0);
  Append(writer->get(), 5000);
  const auto list = uploads_->List();
  ASSERT_EQ(list->size(), 1u);
  EXPECT_EQ(list->front().name, "a.b");
  EXPECT_EQ(list->front().bytes, 5000);
}

RILIEVO_OF_EVERY_STORE_BUT_S3(ScanUploadsTest);

}  // namespace
}  // namespace rilievo
