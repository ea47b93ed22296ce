#include "server/store/blob_store.h"

#include <fstream>
#include <random>

#include "server/store/content_name.h"
#include "tests/unit/server/store/bytes_fixture.h"

namespace rilievo {
namespace {

class BlobStoreTest : public BytesTest {};

TEST_P(BlobStoreTest, KeepsBytesUnderTheirHash) {
  const auto name = blobs_->Put({{'a', 'b'}, {}, {'c'}});
  ASSERT_TRUE(name.ok()) << name.status();
  EXPECT_EQ(*name, ContentNameOf("abc"));
  EXPECT_EQ(Contents(*blobs_->Read(*name)), "abc");
  EXPECT_EQ(*blobs_->BytesOf(*name), 3);
  EXPECT_EQ(*blobs_->Put({{'a', 'b', 'c'}}), *name) << "the same bytes once more";
  ASSERT_EQ(blobs_->List()->size(), 1u);
  EXPECT_EQ(blobs_->List()->front().name, *name);
  EXPECT_EQ(blobs_->List()->front().bytes, 3);
  Reopen();
  const auto open = blobs_->Read(*name);
  ASSERT_TRUE(blobs_->Remove(*name).ok());
  EXPECT_EQ(Contents(*open), "abc") << "who reads it reads it to its end";
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read(*name).status()));
  EXPECT_TRUE(absl::IsNotFound(blobs_->BytesOf(*name).status()));
  EXPECT_TRUE(blobs_->Remove(*name).ok());
}

TEST_P(BlobStoreTest, WhatIsNotAdoptedIsNoBlob) {
  {
    const auto staged = blobs_->Stage({{'a', 'b'}});
    ASSERT_TRUE(staged.ok()) << staged.status();
    EXPECT_EQ((*staged)->name(), ContentNameOf("ab"));
    EXPECT_EQ((*staged)->bytes(), 2);
    EXPECT_TRUE(blobs_->List()->empty());
  }
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read(ContentNameOf("ab")).status()));
  const auto broken =
      blobs_->StageFrom([] { return absl::StatusOr<std::string_view>(absl::UnknownError("no")); });
  EXPECT_EQ(broken.status().code(), absl::StatusCode::kUnknown);
  EXPECT_TRUE(blobs_->List()->empty());
}

TEST_P(BlobStoreTest, LargeOnesOfOddPiecesAreWhole) {
  std::mt19937 random(3);
  std::string bytes;
  std::vector<std::vector<uint8_t>> pieces;
  while (bytes.size() < 18'000'000) {
    std::vector<uint8_t> piece(random() % 700'000);
    for (uint8_t& byte : piece) byte = static_cast<uint8_t>(random());
    bytes.append(piece.begin(), piece.end());
    pieces.push_back(std::move(piece));
  }
  const auto name = blobs_->Put(pieces);
  ASSERT_TRUE(name.ok()) << name.status();
  EXPECT_EQ(*name, ContentNameOf(bytes));
  EXPECT_EQ(Contents(*blobs_->Read(*name)), bytes);
}

TEST_P(BlobStoreTest, NamesThatAreNoHashesReachNothing) {
  std::ofstream(test_ / "secret") << "x";
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read("../secret").status()));
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read("").status()));
}

TEST_P(BlobStoreTest, OneThatIsSetAsideMayComeAgain) {
  const std::string name = *blobs_->Put({{'x'}});
  ASSERT_TRUE(blobs_->SetAside(name).ok());
  EXPECT_TRUE(absl::IsNotFound(blobs_->Read(name).status()));
  EXPECT_TRUE(blobs_->List()->empty());
  EXPECT_EQ(*blobs_->Put({{'x'}}), name);
  EXPECT_EQ(Contents(*blobs_->Read(name)), "x");
}

INSTANTIATE_TEST_SUITE_P(Of, BlobStoreTest,
                         testing::Values(StorePlace::kFolder, StorePlace::kPostgres,
                                         StorePlace::kPostgresAndS3),
                         NameOfPlace);

}  // namespace
}  // namespace rilievo
