#include "core/control/planar/plane_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/control/choose_topology.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

Eigen::Isometry3d TurnedAndMoved() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.rotate(Eigen::AngleAxisd(1.1, Vector3d(1, 2, -1).normalized()));
  pose.pretranslate(Vector3d(0.1, -0.05, 0.02));
  return pose;
}

TEST(FitPlaneFrame, FindsTheTurnedPlaneWithItsUpperSide) {
  const PlaneFrame frame = FitPlaneFrame(TerrainCloud(5000, 0, TurnedAndMoved()));
  EXPECT_GT(frame.axes.col(2).dot(TurnedAndMoved().linear().col(2)), 0.99);
  EXPECT_NEAR(frame.axes.determinant(), 1, 1e-12);
  const Vector3d x(0.3, -0.2, 0.1);
  EXPECT_LT((frame.UnitFromPlane(frame.PlaneFromUnit(x)) - x).norm(), 1e-14);
}

TEST(FitPlaneFrame, LooksAtTwoWallsOfACornerFromBetween) {
  // Two unit squares that meet at a right angle, one reaching far: the principal plane of the
  // points is edge-on to neither only by chance, the mean normal sees both.
  Eigen::Matrix3Xd points(3, 2000), normals(3, 2000);
  for (int i = 0; i < 1000; ++i) {
    const double s = (i % 32) / 32.0, t = (i / 32) / 32.0;
    points.col(i) = 0.5 * Vector3d(s, t, 0);
    normals.col(i) = Vector3d(0, 0, 1);
    points.col(1000 + i) = 0.5 * Vector3d(0, t, s);
    normals.col(1000 + i) = Vector3d(1, 0, 0);
  }
  const OrientedCloud cloud = MakeCloud(points, normals);
  const PlaneFrame frame = FitPlaneFrame(cloud);
  EXPECT_GT(frame.axes.col(2).dot(Vector3d(1, 0, 1).normalized()), 0.95);
  const HeightFieldCheck check = CheckHeightField(cloud, frame, RunContext{}).value();
  EXPECT_GT(check.facing, 0.99);
  EXPECT_GT(check.single_sheet, 0.99);
}

TEST(CheckHeightField, TellsATerrainFromASphereAndFromTwoFloors) {
  const OrientedCloud terrain = TerrainCloud(8000, 0.1, TurnedAndMoved());
  const HeightFieldCheck field =
      CheckHeightField(terrain, FitPlaneFrame(terrain), RunContext{}).value();
  EXPECT_EQ(field.single_sheet, 1);
  EXPECT_GT(field.facing, 0.999);

  const OrientedCloud sphere = SphereCloud(8000);
  const HeightFieldCheck round =
      CheckHeightField(sphere, FitPlaneFrame(sphere), RunContext{}).value();
  EXPECT_LT(round.single_sheet, 0.4);
  EXPECT_LT(round.facing, 0.5);

  OrientedCloud upper = TerrainCloud(4000, 0);
  upper.points.row(2).array() += 0.3;
  const OrientedCloud floors = Joined(TerrainCloud(4000, 0), upper);
  EXPECT_LT(CheckHeightField(floors, FitPlaneFrame(floors), RunContext{}).value().single_sheet,
            0.2);
}

// A square of side 0.8 whose middle is higher; `wall`: points on its steps, as dense as elsewhere.
OrientedCloud Plateau(double height, bool wall) {
  constexpr double kSpacing = 0.01;
  std::vector<Vector3d> points;
  for (double y = 0; y < 0.8; y += kSpacing) {
    for (double x = -0.4; x < 0.4; x += kSpacing) {
      points.emplace_back(x, y, std::abs(x) > 0.2 ? 0 : height);
    }
    for (double z = 0; wall && z < height; z += kSpacing) {
      points.emplace_back(-0.2, y, z);
      points.emplace_back(0.2, y, z);
    }
  }
  Eigen::Matrix3Xd matrix(3, points.size());
  for (size_t i = 0; i < points.size(); ++i) matrix.col(static_cast<Eigen::Index>(i)) = points[i];
  const Eigen::Matrix3Xd up = Vector3d::UnitZ().replicate(1, matrix.cols());
  return MakeCloud(matrix, up);
}

TEST(CheckHeightField, MeasuresTheWallsThatNoPointSaw) {
  const PlaneFrame level;
  const auto walls = [&](const OrientedCloud& cloud) {
    return CheckHeightField(cloud, level, RunContext{}).value().unseen_walls;
  };
  EXPECT_EQ(walls(TerrainCloud(8000, 0.1)), 0);
  EXPECT_EQ(walls(Plateau(0.2, /*wall=*/true)), 0);
  // Two of 0.8 x 0.2 beside 0.8 x 0.8, each met from one or two cells on either side.
  EXPECT_GT(walls(Plateau(0.2, /*wall=*/false)), 0.2);
  EXPECT_LT(walls(Plateau(0.2, /*wall=*/false)), 0.8);
  EXPECT_EQ(ChooseTopology(Plateau(0.2, /*wall=*/false), RunContext{}).value().topology,
            Topology::kArbitrary);
  EXPECT_EQ(ChooseTopology(Plateau(0.01, /*wall=*/false), RunContext{}).value().topology,
            Topology::kPlanar);
}

TEST(PointArea, SumsToTheSurface) {
  const OrientedCloud sphere = SphereCloud(4000, 0.28);
  double sum = 0;
  for (int i = 0; i < sphere.points.cols(); ++i) sum += PointArea(sphere, i);
  EXPECT_NEAR(sum / (4 * std::numbers::pi * 0.28 * 0.28), 1, 0.1);
}

}  // namespace
}  // namespace rilievo
