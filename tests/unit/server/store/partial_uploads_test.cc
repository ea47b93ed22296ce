#include "server/store/partial_uploads.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>

#include "server/store/blob_folder.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

class PartialUploadsTest : public testing::Test {
 protected:
  TestFolder test_;
  const BlobFolder blobs_ = *BlobFolder::Open(test_ / "blobs");
  const std::unique_ptr<PartialUploads> uploads_ = *PartialUploads::Open(test_ / "uploads", blobs_);
};

TEST_F(PartialUploadsTest, DamageOnDiskIsNoticed) {
  const std::string scan(300'000, 's');
  ASSERT_TRUE((*uploads_->Continue("a", 0))->Append(scan.substr(0, 200'000)).ok());
  std::fstream file(test_ / "uploads/a", std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(1000);
  file.put('t');
  file.close();
  auto writer = uploads_->Continue("a", 200'000);
  ASSERT_TRUE((*writer)->Append(scan.substr(200'000)).ok());
  const absl::Status refused = (*writer)->Finish(
      300'000, ContentNameOf(scan), [](const StagedBlob& staged) { return staged.Adopt(nullptr); });
  EXPECT_EQ(refused.code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(blobs_.List()->empty());
}

// Whoever asks to go on costs the server no reading of what is stored.
TEST_F(PartialUploadsTest, GoingOnReadsNothing) {
  {
    auto writer = uploads_->Continue("a", 0);
    ASSERT_TRUE((*writer)->Append(std::string(64 << 20, 'x')).ok());
  }
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(uploads_->Continue("a", 64 << 20).ok());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

}  // namespace
}  // namespace rilievo
