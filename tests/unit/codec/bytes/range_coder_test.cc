#include "core/codec/bytes/range_coder.h"

#include <cmath>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

struct CodedBit {
  bool bit;
  uint32_t probability;
};

// Bits drawn with their own probability, in [1, 65535] / 65536.
std::vector<CodedBit> DrawBits(int count, uint64_t seed, uint32_t fixed_probability = 0) {
  std::vector<CodedBit> bits;
  for (int i = 0; i < count; ++i) {
    const uint32_t probability =
        fixed_probability != 0 ? fixed_probability : 1 + MixedBits(seed + 2 * i) % 65535;
    bits.push_back({MixedBits(seed + 2 * i + 1) % 65536 < probability, probability});
  }
  return bits;
}

std::vector<uint8_t> Encode(const std::vector<CodedBit>& bits) {
  RangeEncoder encoder;
  for (const CodedBit& b : bits) encoder.Code(b.bit, b.probability);
  return encoder.Finish();
}

TEST(RangeCoderTest, RoundTripsAnyNumberOfBits) {
  for (int count = 0; count < 300; ++count) {
    const std::vector<CodedBit> bits = DrawBits(count, 1000 + count);
    const std::vector<uint8_t> bytes = Encode(bits);
    RangeDecoder decoder(bytes);
    for (const CodedBit& b : bits) ASSERT_EQ(decoder.Code(false, b.probability), b.bit);
    EXPECT_FALSE(decoder.overrun()) << count;
  }
}

// Long runs of likely ones keep `low` below a carry for many bytes; unlikely bits then bring it.
TEST(RangeCoderTest, ResolvesCarries) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    std::vector<CodedBit> bits;
    for (int i = 0; i < 400; ++i) {
      const uint32_t probability = MixedBits(seed * 1000 + i) % 2 == 0 ? 1 : 65535;
      bits.push_back({MixedBits(seed * 1000 + i + 500) % 16 == 0, probability});
    }
    const std::vector<uint8_t> bytes = Encode(bits);
    RangeDecoder decoder(bytes);
    for (const CodedBit& b : bits) ASSERT_EQ(decoder.Code(false, b.probability), b.bit);
  }
}

TEST(RangeCoderTest, CostsTheEntropy) {
  for (uint32_t probability : {60u, 3000u, 20000u, 32768u, 65000u}) {
    const int count = 200000;
    const std::vector<CodedBit> bits = DrawBits(count, 7, probability);
    const double p = probability / 65536.0;
    double ideal = 0;
    for (const CodedBit& b : bits) ideal -= std::log2(b.bit ? p : 1 - p);
    EXPECT_NEAR(8.0 * Encode(bits).size(), ideal, 0.0005 * ideal + 40) << probability;
  }
}

TEST(RangeCoderTest, NoticesThatBytesAreMissing) {
  const std::vector<CodedBit> bits = DrawBits(2000, 3, 32768);
  std::vector<uint8_t> bytes = Encode(bits);
  bytes.resize(bytes.size() / 2);
  RangeDecoder decoder(bytes);
  for (const CodedBit& b : bits) decoder.Code(false, b.probability);
  EXPECT_TRUE(decoder.overrun());
}

}  // namespace
}  // namespace rilievo
