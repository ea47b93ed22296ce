#include "core/codec/bytes/bit_models.h"

#include <cmath>

#include "core/codec/bytes/range_coder.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

TEST(LogisticTablesTest, AreTheLogisticFunctionAndItsInverse) {
  const LogisticTables& tables = LogisticTables::Get();
  for (int x = -2047; x <= 2047; ++x) {
    EXPECT_NEAR(tables.Squash(x), 65536 / (1 + std::exp(-x / 256.0)), 1.01) << x;
    EXPECT_EQ(tables.Squash(x) + tables.Squash(-x), 65536) << x;
  }
  EXPECT_EQ(tables.Squash(-1'000'000'000'000), tables.Squash(-2047));
  EXPECT_EQ(tables.Squash(1'000'000'000'000), tables.Squash(2047));
  for (int p = 8; p < 4088; ++p) {
    const double middle = (p + 0.5) / 4096;
    EXPECT_NEAR(tables.Stretch(p), 256 * std::log(middle / (1 - middle)), 2) << p;
  }
}

TEST(BitModelTest, LearnsAProbability) {
  BitModel model;
  for (int i = 0; i < 20000; ++i) model.Update(MixedBits(i) % 100 < 20, 255);
  EXPECT_NEAR(model.probability12() / 4096.0, 0.2, 0.06);
  // Count-based steps: after n equal bits the probability is near that of the n + 1st.
  BitModel fresh;
  for (int i = 0; i < 3; ++i) fresh.Update(true, 255);
  EXPECT_GT(fresh.probability12(), 4096 * 0.8);
}

TEST(BitModelTest, StaysInsideItsRange) {
  BitModel ones, zeros;
  for (int i = 0; i < 100000; ++i) {
    ones.Update(true, 1023);
    zeros.Update(false, 1023);
  }
  EXPECT_GE(ones.probability12(), 4094);
  EXPECT_EQ(zeros.probability12(), 0);
}

// One context knows the bit, the other is noise: the weights must find that out.
TEST(BitMixerTest, TrustsTheContextThatKnows) {
  RangeEncoder encoder;
  BitMixer<2> mixer;
  BitModel knowing[2], noise[2];
  const int count = 20000;
  for (int i = 0; i < count; ++i) {
    const bool bit = MixedBits(2 * i) % 2 == 0;
    mixer.Code(encoder, bit, {&knowing[bit], &noise[MixedBits(2 * i + 1) % 2]}, 255);
  }
  EXPECT_LT(8.0 * encoder.Finish().size(), 0.01 * count);
}

TEST(BitModelsTest, CostIsTheLogOfTheProbability) {
  for (int probability : {100, 5000, 32768, 60000}) {
    EXPECT_NEAR(BitCost(BitCosts(), true, probability), -std::log2(probability / 65536.0), 0.12);
    EXPECT_NEAR(BitCost(BitCosts(), false, probability), -std::log2(1 - probability / 65536.0),
                0.02);
  }
}

}  // namespace
}  // namespace rilievo
