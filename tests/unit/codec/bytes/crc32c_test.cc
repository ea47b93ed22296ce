#include "core/codec/bytes/crc32c.h"

#include <numeric>
#include <string_view>
#include <vector>

#include "gtest/gtest.h"

namespace rilievo {
namespace {

std::vector<uint8_t> Bytes(std::string_view text) { return {text.begin(), text.end()}; }

// The check value of the CRC catalogue, and the vectors of RFC 3720 B.4.
TEST(Crc32cTest, KnownValues) {
  EXPECT_EQ(Crc32c(Bytes("123456789")), 0xe3069283u);
  EXPECT_EQ(Crc32c(std::vector<uint8_t>(32, 0x00)), 0x8a9136aau);
  EXPECT_EQ(Crc32c(std::vector<uint8_t>(32, 0xff)), 0x62a8ab43u);
  std::vector<uint8_t> ascending(32);
  std::iota(ascending.begin(), ascending.end(), uint8_t{0});
  EXPECT_EQ(Crc32c(ascending), 0x46dd794eu);
  EXPECT_EQ(Crc32c({}), 0u);
}

TEST(Crc32cTest, GoesOnFromAPrevious) {
  EXPECT_EQ(Crc32c(Bytes("6789"), Crc32c(Bytes("12345"))), Crc32c(Bytes("123456789")));
}

}  // namespace
}  // namespace rilievo
