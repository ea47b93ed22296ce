#include "core/points/point_support.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(HasSupportTest, AsFarAsSpacingOrNoiseOfTheNearestPointGo) {
  OrientedCloud cloud;
  cloud.points.resize(3, 2);
  cloud.points << 0, 10, 0, 0, 0, 0;
  cloud.spacing = {0.1f, 1.0f};
  cloud.noise = {0, 1.0f};
  const PointIndex index(cloud.points);
  EXPECT_TRUE(HasSupport(cloud, index, {0, 0.15, 0}));
  EXPECT_FALSE(HasSupport(cloud, index, {0, 0.17, 0}));
  EXPECT_TRUE(HasSupport(cloud, index, {10, 0, 3.95}));
  EXPECT_FALSE(HasSupport(cloud, index, {10, 0, 4.05}));
}

}  // namespace
}  // namespace rilievo
