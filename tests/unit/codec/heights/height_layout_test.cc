#include "core/codec/heights/height_layout.h"

#include "gtest/gtest.h"

namespace rilievo {
namespace {

TEST(HeightLayoutTest, RoundTrips) {
  for (bool empty : {false, true}) {
    HeightLayout layout;
    layout.lifting = {3, 15};
    layout.empty = empty;
    layout.dequantizer.step = 70000;
    layout.dequantizer.draw = {17, 255};
    std::vector<uint8_t> payload = WriteHeightLayout(layout);
    EXPECT_EQ(payload.size(), empty ? 1u : 6u);
    payload.push_back(42);
    const auto read = ReadHeightLayout(payload, 2);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->lifting.rule, 3);
    EXPECT_EQ(read->lifting.strength, 15);
    EXPECT_EQ(read->empty, empty);
    EXPECT_EQ(read->coded.size(), 1u);
    if (empty) continue;
    EXPECT_EQ(read->dequantizer.step, 70000);
    EXPECT_EQ(read->dequantizer.draw, layout.dequantizer.draw);
  }
}

TEST(HeightLayoutTest, ImpossibleValuesAreDataLoss) {
  const auto refused = [](std::vector<uint8_t> payload) {
    return ReadHeightLayout(payload, 0).status().code() == absl::StatusCode::kDataLoss;
  };
  EXPECT_FALSE(refused({0x18, 1, 0, 0}));
  EXPECT_TRUE(refused({}));
  EXPECT_TRUE(refused({0x18, 1, 0}));
  EXPECT_TRUE(refused({0x48, 1, 0, 0}));                        // rule 4
  EXPECT_TRUE(refused({0x18, 0, 0, 0}));                        // step 0
  EXPECT_TRUE(refused({0x18, 0x81, 0x80, 0x80, 0x08, 0, 0}));   // step 2^24 + 1
  EXPECT_FALSE(refused({0x18, 0x80, 0x80, 0x80, 0x08, 0, 0}));  // step 2^24
  EXPECT_FALSE(refused({0x80}));
}

TEST(HeightLayoutTest, DrawsTowardsZero) {
  const Dequantizer dequantizer = {256, {64, 16}};
  EXPECT_EQ(dequantizer.Value(0), 0);
  EXPECT_EQ(dequantizer.Value(1), 192);
  EXPECT_EQ(dequantizer.Value(-1), -192);
  EXPECT_EQ(dequantizer.Value(2), 496);
  EXPECT_EQ(dequantizer.Value(-3), -752);
}

}  // namespace
}  // namespace rilievo
