#include "core/codec/bytes/pieces.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<std::vector<uint8_t>> kPieces = {{1, 2, 3}, {}, {4}};

// After two bytes of something else.
std::vector<uint8_t> Payload() {
  std::vector<uint8_t> payload = {7, 8};
  AppendPieces(kPieces, &payload);
  return payload;
}

TEST(PiecesTest, ComeBackAsTheyWere) {
  const std::vector<uint8_t> payload = Payload();
  const auto pieces = ReadPieces(payload, 2, 3, "the pieces");
  ASSERT_TRUE(pieces.ok()) << pieces.status();
  EXPECT_THAT(*CheckPiece((*pieces)[0], "one"), ElementsAre(1, 2, 3));
  EXPECT_TRUE((*pieces)[1].empty());
  EXPECT_THAT(*CheckPiece((*pieces)[2], "one"), ElementsAre(4));
}

TEST(PiecesTest, AnyBeginningIsCutOff) {
  const std::vector<uint8_t> payload = Payload();
  for (size_t size = 0; size < payload.size(); ++size) {
    const auto pieces = ReadPieces(std::span(payload).first(size), 2, 3, "the pieces");
    EXPECT_EQ(pieces.status().code(), absl::StatusCode::kDataLoss) << size;
    EXPECT_THAT(pieces.status().message(), HasSubstr("the pieces are cut off"));
  }
}

TEST(PiecesTest, MoreThanCanBeThereAreNotLookedFor) {
  EXPECT_EQ(ReadPieces(Payload(), 2, 1 << 30, "the pieces").status().code(),
            absl::StatusCode::kDataLoss);
}

TEST(PiecesTest, AChangedByteIsFoundWhereItLies) {
  const std::vector<uint8_t> payload = Payload();
  for (size_t at = 0; at < payload.size(); ++at) {
    std::vector<uint8_t> changed = payload;
    changed[at] ^= 1;
    const auto pieces = ReadPieces(changed, 2, 3, "the pieces");
    const bool found = !pieces.ok() || !CheckPiece((*pieces)[0], "one").ok() ||
                       !CheckPiece((*pieces)[2], "one").ok();
    EXPECT_TRUE(found) << at;
  }
}

}  // namespace
}  // namespace rilievo
