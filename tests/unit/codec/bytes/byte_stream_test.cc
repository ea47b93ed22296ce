#include "core/codec/bytes/byte_stream.h"

#include <cmath>
#include <limits>

#include "gtest/gtest.h"

namespace rilievo {
namespace {

TEST(ByteStreamTest, ShortDoublesLeaveZerosOff) {
  const struct {
    double value;
    size_t bytes;
  } cases[] = {{0, 1}, {1, 3}, {-2.5, 3}, {0.1, 9}, {812.75, 4}, {4600000.5, 6}, {1e300, 9}};
  for (const auto& c : cases) {
    std::vector<uint8_t> bytes;
    ByteWriter(bytes).ShortF64(c.value);
    EXPECT_EQ(bytes.size(), c.bytes) << c.value;
    ByteReader reader(bytes);
    EXPECT_EQ(reader.ShortF64(), c.value);
    EXPECT_TRUE(reader.ok());
    for (size_t size = 0; size < bytes.size(); ++size) {
      ByteReader cut{std::span(bytes).first(size)};
      cut.ShortF64();
      EXPECT_FALSE(cut.ok());
    }
  }
  const std::vector<uint8_t> nine = {9, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  ByteReader reader(nine);
  reader.ShortF64();
  EXPECT_FALSE(reader.ok());
}

TEST(ByteStreamTest, VarintsRoundTrip) {
  for (uint64_t value : {uint64_t{0}, uint64_t{127}, uint64_t{128}, (uint64_t{1} << 63) - 1}) {
    std::vector<uint8_t> bytes;
    ByteWriter(bytes).Varint(value);
    ByteReader reader(bytes);
    EXPECT_EQ(reader.Varint(), value);
    EXPECT_EQ(reader.remaining(), 0u);
  }
}

}  // namespace
}  // namespace rilievo
