#include "core/scan/local_shape/patch_moments.h"

#include <gtest/gtest.h>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

Eigen::Matrix3d Full(const PatchMoments& moments) {
  const Eigen::Matrix<double, 6, 1> c = moments.covariance.cast<double>();
  Eigen::Matrix3d full;
  full << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  return full;
}

// Mean offset and covariance of given points, in double.
void ExpectMoments(const PatchMoments& moments, const Eigen::Matrix3Xd& points,
                   const Eigen::Vector3d& center) {
  const Eigen::Vector3d mean = points.rowwise().mean();
  const Eigen::Matrix3Xd centered = points.colwise() - mean;
  const Eigen::Matrix3d covariance =
      centered * centered.transpose() / static_cast<double>(points.cols());
  const double size = std::sqrt(covariance.trace());
  EXPECT_LT((moments.mean_offset.cast<double>() - (mean - center)).norm(), 1e-5 * size);
  EXPECT_LT((Full(moments) - covariance).norm(), 1e-5 * size * size);
}

TEST(PatchMomentsTest, MatchesDoubleSumsOverTheNeighbours) {
  const PreparedCloud prepared = Prepare(TorusCloud(4000, 1));
  const Eigen::Matrix3Xd& points = prepared.scan.points;
  const auto moments = ComputePatchMoments(points, prepared.graph, RunContext{});
  ASSERT_TRUE(moments.ok());
  for (int i = 0; i < 4000; i += 37) {
    Eigen::Matrix3Xd patch(3, 17);
    patch.col(0) = points.col(i);
    for (int j = 0; j < 16; ++j) patch.col(j + 1) = points.col(prepared.graph.neighbors(i)[j]);
    ExpectMoments((*moments)[i], patch, points.col(i));
  }
}

TEST(PatchMomentsTest, SumsAreThoseOfTheJoinedPoints) {
  const PreparedCloud prepared = Prepare(SphereCloud(3000, 2));
  const Eigen::Matrix3Xd& points = prepared.scan.points;
  const auto moments = ComputePatchMoments(points, prepared.graph, RunContext{}).value();
  PatchSum sum;
  Eigen::Matrix3Xd joined(3, 3 * 17);
  int column = 0;
  for (const int i : {100, 103, 110}) {
    sum.Add(moments[i], points.col(i) - points.col(100));
    joined.col(column++) = points.col(i);
    for (const int j : prepared.graph.neighbors(i)) joined.col(column++) = points.col(j);
  }
  ExpectMoments(sum.Mean(), joined, points.col(100));
}

TEST(PatchMomentsTest, PlaneOfATiltedDisc) {
  Random random(3);
  const Eigen::Vector3d normal = RandomDirection(&random);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  Eigen::Matrix3d covariance =
      4.0 * u * u.transpose() + 2.0 * v * v.transpose() + 0.01 * normal * normal.transpose();
  PatchMoments moments;
  moments.covariance << static_cast<float>(covariance(0, 0)), static_cast<float>(covariance(0, 1)),
      static_cast<float>(covariance(0, 2)), static_cast<float>(covariance(1, 1)),
      static_cast<float>(covariance(1, 2)), static_cast<float>(covariance(2, 2));
  const PatchPlane plane = FitPlane(moments);
  EXPECT_NEAR(std::abs(plane.normal.dot(normal)), 1, 1e-6);
  EXPECT_NEAR(plane.thickness, 0.01, 1e-5);
  EXPECT_NEAR(plane.spread, 3.0, 1e-5);
}

TEST(PatchMomentsTest, PlaneOfNothingIsAUnitNormal) {
  const PatchPlane plane = FitPlane(PatchMoments{});
  EXPECT_NEAR(plane.normal.norm(), 1, 1e-12);
  EXPECT_EQ(plane.thickness, 0);
  EXPECT_EQ(plane.spread, 0);
}

}  // namespace
}  // namespace rilievo
