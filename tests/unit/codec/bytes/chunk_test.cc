#include "core/codec/bytes/chunk.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Byte by byte what docs/dss-format.md says; the checksums by an implementation of its own.
TEST(ChunkTest, BytesAreThoseOfTheFormatPage) {
  const std::vector<uint8_t> payload = {0xaa, 0xbb};
  const std::vector<uint8_t> first = WrapChunk('C', payload, true);
  EXPECT_THAT(std::vector<uint8_t>(first.begin(), first.begin() + 13),
              ElementsAre(0x89, 'D', 'S', 'S', 0x0d, 0x0a, 0x1a, 0x0a, 3, 'C', 2, 0xaa, 0xbb));
  EXPECT_EQ(first.size(), 17u);
  const std::vector<uint8_t> later = WrapChunk('H', std::vector<uint8_t>(300, 7), false);
  EXPECT_EQ(later.size(), 1 + 2 + 300 + 4u);
  EXPECT_EQ(later[1], 0xac);  // 300 = 2 * 128 + 44
  EXPECT_EQ(later[2], 0x02);
}

TEST(ChunkTest, ListsWhatWasWrapped) {
  std::vector<uint8_t> bytes = WrapChunk('C', std::vector<uint8_t>{1, 2, 3}, true);
  const size_t first_size = bytes.size();
  for (uint8_t byte : WrapChunk('H', std::vector<uint8_t>(1000, 9), false)) bytes.push_back(byte);
  const auto list = ListChunks(bytes);
  ASSERT_TRUE(list.ok()) << list.status();
  EXPECT_EQ(list->version, kDssVersion);
  ASSERT_EQ(list->chunks.size(), 2u);
  EXPECT_EQ(list->chunks[0].tag, 'C');
  EXPECT_THAT(list->chunks[0].payload, ElementsAre(1, 2, 3));
  EXPECT_EQ(list->chunks[0].bytes, static_cast<int64_t>(first_size));
  EXPECT_EQ(list->chunks[1].payload.size(), 1000u);
}

TEST(ChunkTest, LengthsBeyondTheEndAreRefused) {
  std::vector<uint8_t> bytes = WrapChunk('C', {}, true);
  bytes[10] = 0x80;  // a length that goes on, through the checksum and past the end
  for (size_t i = 11; i < bytes.size(); ++i) bytes[i] = 0xff;
  EXPECT_EQ(ListChunks(bytes).status().code(), absl::StatusCode::kDataLoss);
  for (int i = 0; i < 8; ++i) bytes.push_back(0x7f);  // a length of 2^62
  EXPECT_THAT(ListChunks(bytes).status().message(), HasSubstr("chunk 0 is cut off"));
}

}  // namespace
}  // namespace rilievo
