#include "core/control/loop_witness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace rilievo {
namespace {

constexpr int kAround = 16;
constexpr double kRadius = 0.1;

// A ring of vertices around the z axis with outward normals, and points where the vertices are.
struct Ring {
  Eigen::Matrix3Xd vertices{3, kAround}, normals{3, kAround};
  std::vector<int> loop = std::vector<int>(kAround);
  OrientedCloud cloud;

  Ring() {
    std::iota(loop.begin(), loop.end(), 0);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      normals.col(i) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    }
    vertices = kRadius * normals;
    cloud.points = vertices;
    cloud.normals = normals;
    cloud.spacing.assign(kAround, static_cast<float>(2 * std::numbers::pi * kRadius / kAround));
  }
  bool Lined() const {
    const PointIndex index(cloud.points);
    return LoopWitness(cloud, index).Lines(loop, vertices, normals);
  }
};

TEST(LoopWitnessTest, PointsWithTheNormalsOfTheMeshLineALoop) { EXPECT_TRUE(Ring().Lined()); }

TEST(LoopWitnessTest, PointsOfSheetsAcrossItDoNot) {
  Ring ring;
  for (int i = 0; i < kAround; ++i) {
    ring.cloud.normals.col(i) = Eigen::Vector3d(0, 0, i % 2 == 0 ? 1 : -1);
  }
  EXPECT_FALSE(ring.Lined());
}

TEST(LoopWitnessTest, NorDoPointsThatFaceOneWay) {
  Ring ring;
  ring.cloud.normals.setConstant(0);
  ring.cloud.normals.row(0).setOnes();  // one side of it agrees, the other does not
  EXPECT_FALSE(ring.Lined());
}

TEST(LoopWitnessTest, FewerThanSixPointsAroundAreTooFew) {
  Ring ring;
  const float around = static_cast<float>(2 * std::numbers::pi * kRadius);
  ring.cloud.spacing.assign(kAround, around / 5);
  EXPECT_FALSE(ring.Lined());
  ring.cloud.spacing.assign(kAround, around / 7);
  EXPECT_TRUE(ring.Lined());
}

TEST(LoopWitnessTest, ACloudOfOnePointLinesNothing) {
  Ring ring;
  ring.cloud.points = ring.vertices.leftCols(1).eval();
  ring.cloud.normals = ring.normals.leftCols(1).eval();
  ring.cloud.spacing.resize(1);
  EXPECT_FALSE(ring.Lined());
}

}  // namespace
}  // namespace rilievo
