#include "core/geometry/spatial_frame.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rilievo {
namespace {

TEST(SpatialFrameTest, ThereAndBack) {
  const SpatialFrame frame = {{1, -2, 3}, 5};
  const Eigen::Vector3d scan(0.3, 7, -4);
  EXPECT_NEAR((frame.ScanFromUnit(frame.UnitFromScan(scan)) - scan).norm(), 0, 1e-14);
}

TEST(SpatialFrameTest, RoundedStaysCloseInFewDigits) {
  for (const double scale : {1e-150, 1e-3, 1.0, 7e5, 1e150}) {
    const SpatialFrame frame = {scale * Eigen::Vector3d(1.2345678, -98.7654321, 0.0123456),
                                scale * 3.1415926535};
    const SpatialFrame rounded = Rounded(frame);
    EXPECT_NEAR(rounded.diagonal / frame.diagonal, 1, 0x1p-20) << scale;
    EXPECT_LE((rounded.center - frame.center).cwiseAbs().maxCoeff(), 0x1p-11 * frame.diagonal);
    // The digits that are left: 21 of the diagonal, the centre in whole steps of the grid.
    int exponent = 0;
    std::frexp(rounded.diagonal, &exponent);
    const double digits = std::ldexp(rounded.diagonal, 21 - exponent);
    EXPECT_EQ(digits, std::round(digits)) << scale;
    const SpatialFrame again = Rounded(rounded);
    EXPECT_EQ(again.diagonal, rounded.diagonal);
    EXPECT_EQ(again.center, rounded.center);
  }
}

TEST(SpatialFrameTest, CentresTooFarOutForTheGridAreKept) {
  const SpatialFrame frame = {{1e300, 0, 0}, 1e-20};
  EXPECT_EQ(Rounded(frame).center, frame.center);
}

}  // namespace
}  // namespace rilievo
