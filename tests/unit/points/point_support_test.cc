#include "core/points/point_support.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(HasSupportTest, AsFarAsSpacingAndNoiseOfTheNearestPointGo) {
  OrientedCloud cloud;
  cloud.points.resize(3, 2);
  cloud.points << 0, 10, 0, 0, 0, 0;
  cloud.spacing = {0.1f, 1.0f};
  cloud.noise = {0, 0.1f};
  const PointIndex index(cloud.points);
  EXPECT_TRUE(HasSupport(cloud, index, {0, 0.14, 0}, 1.5));
  EXPECT_FALSE(HasSupport(cloud, index, {0, 0.16, 0}, 1.5));
  EXPECT_TRUE(HasSupport(cloud, index, {10, 0, 1.05}, 1));
  EXPECT_FALSE(HasSupport(cloud, index, {10, 0, 1.15}, 1));
}

}  // namespace
}  // namespace rilievo
