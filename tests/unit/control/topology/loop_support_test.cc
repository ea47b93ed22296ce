#include "core/control/topology/loop_support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace rilievo {
namespace {

constexpr int kPointsAround = 16;
constexpr double kRadius = 0.1;

// A ring of vertices around the z axis with outward normals, and points where the vertices are.
struct Ring {
  Eigen::Matrix3Xd vertices{3, kPointsAround}, normals{3, kPointsAround};
  std::vector<int> loop = std::vector<int>(kPointsAround);
  OrientedCloud cloud;

  Ring() {
    std::iota(loop.begin(), loop.end(), 0);
    for (int i = 0; i < kPointsAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kPointsAround;
      normals.col(i) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    }
    vertices = kRadius * normals;
    cloud.points = vertices;
    cloud.normals = normals;
    cloud.spacing.assign(kPointsAround,
                         static_cast<float>(2 * std::numbers::pi * kRadius / kPointsAround));
  }
  bool Lined() const {
    const PointIndex index(cloud.points);
    return LoopSupport(cloud, index).PointsLine(loop, vertices, normals);
  }
  bool LeftOpen() const {
    const PointIndex index(cloud.points);
    return LoopSupport(cloud, index).PointsLeaveOpen(loop, vertices);
  }
};

TEST(LoopSupportTest, PointsWithTheNormalsOfTheMeshLineALoop) { EXPECT_TRUE(Ring().Lined()); }

TEST(LoopSupportTest, PointsOfSheetsAcrossItDoNot) {
  Ring ring;
  for (int i = 0; i < kPointsAround; ++i) {
    ring.cloud.normals.col(i) = Eigen::Vector3d(0, 0, i % 2 == 0 ? 1 : -1);
  }
  EXPECT_FALSE(ring.Lined());
}

TEST(LoopSupportTest, NorDoPointsThatFaceOneWay) {
  Ring ring;
  ring.cloud.normals.setConstant(0);
  ring.cloud.normals.row(0).setOnes();  // one side of it agrees, the other does not
  EXPECT_FALSE(ring.Lined());
}

TEST(LoopSupportTest, FewerThanSixPointsAroundAreTooFew) {
  Ring ring;
  const float around = static_cast<float>(2 * std::numbers::pi * kRadius);
  ring.cloud.spacing.assign(kPointsAround, around / 5);
  EXPECT_FALSE(ring.Lined());
  ring.cloud.spacing.assign(kPointsAround, around / 7);
  EXPECT_TRUE(ring.Lined());
}

TEST(LoopSupportTest, ACloudOfOnePointLinesNothing) {
  Ring ring;
  ring.cloud.points = ring.vertices.leftCols(1).eval();
  ring.cloud.normals = ring.normals.leftCols(1).eval();
  ring.cloud.spacing.resize(1);
  EXPECT_FALSE(ring.Lined());
}

// Two sheets of points across the ring, one either side of its middle.
void AddSheets(Ring* ring) {
  constexpr int kAcross = 9;
  const double step = 2 * kRadius / (kAcross - 1);
  ring->cloud.points.resize(3, 2 * kAcross * kAcross);
  ring->cloud.normals = Eigen::Matrix3Xd::Zero(3, 2 * kAcross * kAcross);
  ring->cloud.spacing.assign(2 * kAcross * kAcross, static_cast<float>(step));
  for (int i = 0; i < ring->cloud.points.cols(); ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    const int x = i / 2 % kAcross, y = i / 2 / kAcross;
    ring->cloud.points.col(i) << x * step - kRadius, y * step - kRadius, 0.4 * side * step;
    ring->cloud.normals(2, i) = side;
  }
}

TEST(LoopSupportTest, SheetsCloseALoopAroundABridgeBetweenThem) {
  Ring ring;
  AddSheets(&ring);
  EXPECT_FALSE(ring.LeftOpen());
  ring.cloud.points.row(2) *= 4;  // more than a spacing off, as above and below a hole
  EXPECT_TRUE(ring.LeftOpen());
}

TEST(LoopSupportTest, AHoleAndARodAreOpen) {
  Ring ring;
  EXPECT_TRUE(ring.LeftOpen());
  ring.cloud.spacing.assign(kPointsAround,
                            2 * kRadius);  // near enough, but facing away from the axis
  EXPECT_TRUE(ring.LeftOpen());
}

TEST(LoopSupportTest, SheetsWithAnEmptyMiddleLeaveItOpen) {
  Ring ring;
  AddSheets(&ring);
  for (auto point : ring.cloud.points.colwise()) {
    const double off_axis = point.head<2>().norm();
    if (off_axis < 0.6 * kRadius) point.head<2>() *= 2 * kRadius / std::max(off_axis, 1e-9);
  }
  EXPECT_TRUE(ring.LeftOpen());
}

TEST(LoopSupportTest, WhereThereAreNoPointsNothingIsSaid) {
  Ring ring;
  ring.cloud.points.row(2).array() += 3 * ring.cloud.spacing[0];
  EXPECT_FALSE(ring.LeftOpen());
}

}  // namespace
}  // namespace rilievo
