#include "core/codec/bytes/residual_model.h"

#include "core/codec/bytes/range_coder.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

TEST(ResidualModelTest, RoundTripsEveryMagnitude) {
  std::vector<int32_t> values = {0, 1, -1, 2, -2, 3, -3};
  for (int bits = 2; bits < 30; ++bits) {
    for (int32_t offset : {-1, 0, 1}) {
      values.push_back((1 << bits) + offset);
      values.push_back(-(1 << bits) - offset);
    }
  }
  values.push_back((1 << 30) - 1);
  values.push_back(-(1 << 30) + 1);
  RangeEncoder encoder;
  ResidualModel<2> writer({3, 5}, 255);
  for (size_t i = 0; i < values.size(); ++i) {
    const int at = static_cast<int>(i);
    EXPECT_EQ(writer.Code(encoder, values[i], {at % 3, at % 5}), values[i]);
  }
  const std::vector<uint8_t> bytes = encoder.Finish();
  RangeDecoder decoder(bytes);
  ResidualModel<2> reader({3, 5}, 255);
  for (size_t i = 0; i < values.size(); ++i) {
    const int at = static_cast<int>(i);
    ASSERT_EQ(reader.Code(decoder, 0, {at % 3, at % 5}), values[i]) << i;
  }
}

// Bits is what Code goes on to take, the sign apart.
TEST(ResidualModelTest, KnowsWhatItWillTake) {
  RangeEncoder encoder;
  ResidualModel<2> model({2, 3}, 255);
  double predicted = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const int32_t value = static_cast<int32_t>(MixedBits(i) % (i % 2 == 0 ? 3 : 40));
    const ResidualModel<2>::Contexts contexts = {i % 2, i % 3};
    ResidualModel<2>::Prices prices(model, contexts);
    const double price = prices.Bits(static_cast<uint32_t>(value));
    prices.Bits(static_cast<uint32_t>(value) + 1);  // changes no other price
    ASSERT_EQ(prices.Bits(static_cast<uint32_t>(value)), price);
    predicted += price;
    // A sign that is always known costs nothing.
    model.CodeWithSign(encoder, value, {i % 2, i % 3}, [](bool negative) { return negative; });
  }
  EXPECT_NEAR(8.0 * encoder.Finish().size() / predicted, 1, 0.01);
}

// A geometric distribution costs its entropy within a few per cent.
TEST(ResidualModelTest, CostsLittleMoreThanTheEntropy) {
  RangeEncoder encoder;
  ResidualModel<1> model({1}, 255);
  const int count = 50000;
  for (int i = 0; i < count; ++i) {
    int32_t value = 0;
    while (MixedBits(100 * static_cast<uint64_t>(i) + value) % 4 != 0) ++value;
    model.Code(encoder, MixedBits(100 * static_cast<uint64_t>(i) + 99) % 2 ? value : -value, {0});
  }
  // P(n) = 3^n / 4^(n + 1): h(1/4) / (1/4) bits, and a sign for the three quarters not zero.
  const double entropy = 0.811278 * 4 + 0.75;
  EXPECT_NEAR(8.0 * encoder.Finish().size() / count, entropy, 0.05 * entropy);
}

}  // namespace
}  // namespace rilievo
