#include "core/codec/heights/height_encoder_unit.h"

#include <gtest/gtest.h>

#include "core/codec/bytes/stored_step.h"
#include "core/codec/heights/height_encoder_draw.h"
#include "core/codec/heights/height_range.h"

namespace rilievo {
namespace {

constexpr double kRounding = 1.0 / 4096;  // of a stored step

TEST(HeightEncoderUnitTest, IsFinerThanTheSmallestStep) {
  const double unit = UnitOfHeights({0.64, 0.32, 1.28}, 0.7, 2, 0);
  EXPECT_NEAR(unit, 0.01, 0.01 * kRounding);
  EXPECT_EQ(unit, StoredStep(unit)) << "as a file holds it";
}

TEST(HeightEncoderUnitTest, HoldsHeightsAndTargets) {
  const double largest = 1000.0 * kMaxHeightUnits;
  const double for_heights = UnitOfHeights({1}, largest, 0, 0);
  EXPECT_NEAR(for_heights, 4000, 4000 * kRounding) << "with room for three times as much";
  const double for_targets = UnitOfHeights({1}, 3, largest, 0);
  EXPECT_NEAR(for_targets, 1000, 1000 * kRounding);
}

TEST(HeightEncoderUnitTest, FarthestIsTheLargestMagnitude) {
  EXPECT_EQ(Farthest<float>({3, -5, 1}), 5);
  EXPECT_EQ(Farthest<double>({0, 2}), 2);
  EXPECT_EQ(Farthest<double>({}), 0);
}

TEST(HeightEncoderUnitTest, IsNeverLessThanWhatDidNotFit) {
  double unit = UnitOfHeights({0.32}, 1, 1, 0);
  for (int i = 0; i < 3; ++i) {
    const double wider = WiderUnit(unit);
    EXPECT_GT(wider, unit);
    EXPECT_EQ(UnitOfHeights({0.32}, 1, 1, wider), wider);
    unit = wider;
  }
}

TEST(HeightEncoderDrawTest, IsTheMeanOfWhatWasRoundedUp) {
  const std::vector<double> targets = {9, 8, 8, -8, 8, 8, 8, 8, 8, 25, 27};  // steps of 10
  const std::vector<int32_t> coded = {0, 1, 1, -1, 1, 1, 1, 1, 1, 3, 3};
  const int end = static_cast<int>(coded.size());
  const auto draw = MeanDraw(targets, coded, 0, end, 10);
  EXPECT_EQ(draw[0], 51) << "0.2 * 256";
  EXPECT_EQ(draw[1], 0) << "of so few nothing is said";
  EXPECT_EQ(MeanDraw(targets, coded, 2, end, 10)[0], 0);
}

}  // namespace
}  // namespace rilievo
