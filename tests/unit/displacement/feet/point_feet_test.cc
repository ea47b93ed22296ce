#include "core/displacement/feet/point_feet.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

std::vector<PointFoot> Feet(const Points& points, const Domain& domain) {
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  return *FindFeet(scan.cloud, domain.refinement, domain.rings, domain.limit, DisplacementOptions(),
                   Threads(2));
}

// sum w_k (N_k . n) h_k - offset, for heights of the vertices.
double Residual(const PointFoot& foot, const std::function<double(int)>& height) {
  double sum = -foot.offset;
  for (int k = 0; k < 3; ++k) sum += foot.weight[k] * height(foot.corner[k]);
  return sum;
}

TEST(FindFeet, OverASheetTheyAreTheHeightsOfThePoints) {
  Random random(1);
  const auto height = [](double x, double y) { return 0.01 + 0.1 * x - 0.05 * y; };
  const Points points = HeightFieldPoints(0.2, 900, &random, height);
  const Domain domain = MakeDomain(Sheet(0.3, 4), 3);
  const std::vector<PointFoot> feet = Feet(points, domain);
  const auto at = [&](int v) {
    return height(domain.limit.positions(0, v), domain.limit.positions(1, v));
  };
  for (const PointFoot& foot : feet) {
    ASSERT_TRUE(foot.found());
    EXPECT_NEAR(Residual(foot, at), 0, 1e-6);
  }
}

TEST(FindFeet, OnASphereEachIsInThePrismOfThePoint) {
  constexpr double kRadius = 0.3;
  const Domain domain = MakeDomain(Octahedron(0.28, 2), 3);
  const std::vector<PointFoot> feet = Feet(SpherePoints(kRadius, 3000), domain);
  const Points points = SpherePoints(kRadius, 3000);
  for (size_t p = 0; p < feet.size(); ++p) {
    ASSERT_TRUE(feet[p].found()) << p;
    // The normals of the limit surface of a sphere are nearly radial: so are the heights.
    const auto height = [&](int v) {
      return SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), kRadius);
    };
    EXPECT_NEAR(Residual(feet[p], height), 0, 4e-4) << p;  // triangles are flat
    for (const int v : feet[p].corner) {
      EXPECT_GT(domain.limit.positions.col(v).normalized().dot(points.normal[p]), 0.98);
    }
  }
}

TEST(FindFeet, NoneForPointsThatFaceAwayLieFarOffOrBeyondTheRim) {
  const Domain domain = MakeDomain(Sheet(0.2, 4), 2);
  Points points;
  Random random(2);
  const Points good = HeightFieldPoints(0.15, 400, &random, [](double, double) { return 0.01; });
  points = good;
  points.Add({0, 0, 0.01}, {0, 0, -1});
  points.Add({0, 0, 0.2}, {0, 0, 1});
  points.Add({0.5, 0, 0}, {0, 0, 1});
  const std::vector<PointFoot> feet = Feet(points, domain);
  for (size_t p = 0; p < good.at.size(); ++p) EXPECT_TRUE(feet[p].found()) << p;
  for (size_t p = good.at.size(); p < feet.size(); ++p) EXPECT_FALSE(feet[p].found()) << p;
}

TEST(FindFeet, BetweenTwoSheetsThePointsTakeTheOneTheyFace) {
  Random random(3);
  const Points above = HeightFieldPoints(0.15, 900, &random, [](double, double) { return 0.0; });
  Points points;
  for (const Vector3d& at : above.at) points.Add(at, {0, 0, -1});
  // One mesh of two sheets; the nearer one faces away from the points.
  ControlMesh mesh = Sheet(0.2, 4, 0.004), other = Sheet(0.2, 4, -0.008);
  other.faces.row(1).swap(other.faces.row(2));
  const int count = static_cast<int>(mesh.vertices.cols());
  ControlMesh both;
  both.vertices.resize(3, 2 * count);
  both.vertices << mesh.vertices, other.vertices;
  both.faces.resize(3, 2 * mesh.faces.cols());
  both.faces << mesh.faces, (other.faces.array() + count).matrix();
  const Domain domain = MakeDomain(both, 2);
  for (const PointFoot& foot : Feet(points, domain)) {
    ASSERT_TRUE(foot.found());
    EXPECT_NEAR(foot.offset, -0.008, 1e-6);
  }
}

TEST(ReachPoints, TheSurfaceIsDrawnToPointsAboveAndBelowIt) {
  const Domain domain = MakeDomain(Sheet(0.2, 4), 2);
  Points points;
  Random random(4);
  points = HeightFieldPoints(0.15, 900, &random, [](double, double) { return 0.0; });
  points.Add({0.03, 0.01, -0.01}, {1, 0, 0.1});  // below the sheet, its normal along it
  points.Add({0.01, 0.01, 0.012}, {1, 0, 0.1});  // above
  points.Add({0.01, 0.01, 0.2}, {1, 0, 0.1});    // too far
  points.Add({0.01, 0.01, 0.012}, {0, 0, -1});   // of another side
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  std::vector<PointFoot> feet = Feet(points, domain);
  const size_t tip = points.at.size() - 3;
  ASSERT_FALSE(feet[tip].found());
  const std::vector<float> heights(domain.size(), 0.002f);
  const std::vector<float> spacing(domain.size(), static_cast<float>(scan.cloud.median_spacing));
  ASSERT_TRUE(
      ReachPoints(scan.cloud, domain.refinement, domain.limit, heights, spacing, Threads(2), &feet)
          .ok());
  ASSERT_TRUE(feet[tip - 1].found());
  EXPECT_NEAR(Residual(feet[tip - 1], [](int) { return -0.01; }), 0, 1e-6);
  ASSERT_TRUE(feet[tip].found());
  EXPECT_NEAR(Residual(feet[tip], [](int) { return 0.012; }), 0, 1e-6);
  EXPECT_FALSE(feet[tip + 1].found());
  EXPECT_FALSE(feet[tip + 2].found());
}

}  // namespace
}  // namespace rilievo
