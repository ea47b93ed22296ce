#include "core/scan/local_shape/otsu_threshold.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

TEST(OtsuSplitTest, TwoGroupsArePartedInTheirGap) {
  std::vector<double> heights = {5.1, 0.1, 4.9, 0, -0.1, 5};
  const OtsuSplit split = OtsuThreshold(heights, 2);
  EXPECT_NEAR(split.threshold, 2.5, 1e-12);
  EXPECT_LT(split.within, 0.01);
}

TEST(OtsuSplitTest, GaussianAndUniformHeightsLeaveTheirShares) {
  Random random(1);
  std::vector<double> gaussian(20000), uniform(20000);
  for (double& height : gaussian) height = random.Normal();
  for (double& height : uniform) height = random.Uniform();
  EXPECT_NEAR(OtsuThreshold(gaussian, 3).within, 0.363, 0.01);
  EXPECT_NEAR(OtsuThreshold(uniform, 3).within, 0.25, 0.01);
}

TEST(OtsuSplitTest, NoSplitOfEqualOrTooFewHeights) {
  std::vector<double> equal(10, 0.5), few = {0, 0, 1, 1};
  EXPECT_EQ(OtsuThreshold(equal, 2).within, 1);
  EXPECT_EQ(OtsuThreshold(few, 3).within, 1);
}

}  // namespace
}  // namespace rilievo
