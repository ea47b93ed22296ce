#include "client/formats/lzf.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rilievo {
namespace {

std::string Decoded(const std::string& compressed, uint64_t size) {
  const auto bytes = DecodeLzf(compressed, size);
  return bytes.ok() ? std::string(bytes->begin(), bytes->end()) : "<error>";
}

TEST(LzfTest, StreamsWrittenByHand) {
  EXPECT_EQ(Decoded(std::string("\x02"
                                "abc",
                                4),
                    3),
            "abc");
  // One literal, then "length 9, distance 1": a run.
  EXPECT_EQ(Decoded(std::string("\x00"
                                "a"
                                "\xe0\x00\x00",
                                5),
                    10),
            "aaaaaaaaaa");
  // "abc" once more: length 3 (code 1), distance 3.
  EXPECT_EQ(Decoded(std::string("\x02"
                                "abc"
                                "\x20\x02",
                                6),
                    6),
            "abcabc");
}

TEST(LzfTest, RoundTripOfNoiseRunsAndPeriods) {
  for (int kind = 0; kind < 4; ++kind) {
    std::string bytes;
    uint32_t state = 1;
    for (int i = 0; i < 50000; ++i) {
      state = state * 1664525 + 1013904223;
      const char noise = static_cast<char>(state >> 24);
      bytes += kind == 0   ? noise
               : kind == 1 ? 'x'
               : kind == 2 ? static_cast<char>(i % 7000 / 3)
                           : static_cast<char>(noise & 3);
    }
    const std::vector<char> packed = EncodeLzf(bytes);
    EXPECT_EQ(Decoded(std::string(packed.begin(), packed.end()), bytes.size()), bytes) << kind;
    if (kind == 1) {
      EXPECT_LT(packed.size(), 700u);
    }
  }
}

TEST(LzfTest, EveryPrefixAndAnyByteEndsCleanly) {
  std::string bytes;
  for (int i = 0; i < 400; ++i) bytes += static_cast<char>("relief"[i * i % 6]);
  const std::vector<char> packed = EncodeLzf(bytes);
  for (size_t length = 0; length < packed.size(); ++length) {
    const std::vector<char> exact(packed.begin(), packed.begin() + static_cast<long>(length));
    EXPECT_FALSE(DecodeLzf({exact.data(), exact.size()}, bytes.size()).ok()) << length;
  }
  for (size_t at = 0; at < packed.size(); ++at) {
    for (int change = 0; change < 256; change += 5) {
      std::vector<char> damaged = packed;
      damaged[at] = static_cast<char>(change);
      const auto result = DecodeLzf({damaged.data(), damaged.size()}, bytes.size());
      if (result.ok()) {
        EXPECT_EQ(result->size(), bytes.size());
      }
    }
  }
}

TEST(LzfTest, AnImpossibleSizeIsRefusedBeforeAllocation) {
  EXPECT_EQ(DecodeLzf("abcd", uint64_t{1} << 60).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace rilievo
