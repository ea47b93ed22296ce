#include "client/formats/export_axes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/formats/mesh_writer.h"

namespace rilievo {
namespace {

TEST(ExportAxesTest, AnOriginIsNearAndShort) {
  const Eigen::Vector3d center(635612.34, 848912.9, 406.55);
  EXPECT_EQ(RoundOrigin(center, 1075), Eigen::Vector3d(636000, 849000, 0));
  EXPECT_EQ(RoundOrigin(center, 999), Eigen::Vector3d(635600, 848900, 400));
  EXPECT_EQ(RoundOrigin(center, 0.2), Eigen::Vector3d(635612.3, 848912.9, 406.6));
  for (const double diagonal : {1e-3, 0.7, 12.0, 5e4}) {
    EXPECT_LE((RoundOrigin(center, diagonal) - center).cwiseAbs().maxCoeff(), diagonal / 2 + 1e-9);
  }
  EXPECT_FALSE(std::signbit(RoundOrigin({-0.1, 0, 0}, 3).x()));  // people read it
}

TEST(ExportAxesTest, FloatRoundingIsThatOfTheFarthestPoint) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
  EXPECT_EQ(FloatRounding(points), 0);
  points(1, 1) = 5.5e6 + 0.25;  // floats are half a unit apart there
  EXPECT_EQ(FloatRounding(points), 0.25);
  EXPECT_EQ(FloatRounding(Eigen::Matrix3Xd(3, 0)), 0);
}

}  // namespace
}  // namespace rilievo
