#include "core/scan/local_shape/estimate_normals.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

OrientedCloud Estimate(const PreparedCloud& prepared, const RunContext& context = RunContext{}) {
  return EstimateNormals(prepared.scan.points, prepared.graph, {}, {}, context).value().cloud;
}

TEST(NormalsTest, AreThoseOfThePlane) {
  KnownCloud plane = PlaneCloud(3000, 1);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()));
  plane.cloud.points = turn * plane.cloud.points;
  plane.normals = turn * plane.normals;
  const PreparedCloud prepared = Prepare(plane);
  const OrientedCloud cloud = Estimate(prepared);
  EXPECT_LT(MeanLineAngle(cloud.normals, prepared.normals), 0.01);
  EXPECT_LT(cloud.median_noise, 1e-7);
  EXPECT_LT((cloud.normals.colwise().norm().array() - 1).abs().maxCoeff(), 1e-9);
}

TEST(NormalsTest, AreThoseOfSphereAndTorus) {
  for (const KnownCloud& known : {SphereCloud(20000, 2), TorusCloud(30000, 3)}) {
    const PreparedCloud prepared = Prepare(known);
    const OrientedCloud cloud = Estimate(prepared);
    EXPECT_LT(MeanLineAngle(cloud.normals, prepared.normals), 1.2);
    // Curvature is not noise: the plane's residual would be 20 times as much.
    EXPECT_LT(cloud.median_noise, 0.02 * cloud.median_spacing);
  }
}

TEST(NormalsTest, StayAccurateUnderNoise) {
  const double diagonal = 2 * std::sqrt(3.0);
  for (const auto& [share, degrees] : {std::pair{0.001, 4.0}, std::pair{0.003, 6.0}}) {
    KnownCloud sphere = SphereCloud(60000, 4);
    AddNoise(share * diagonal, 5, &sphere);
    const PreparedCloud prepared = Prepare(sphere);
    const OrientedCloud cloud = Estimate(prepared);
    EXPECT_LT(MeanLineAngle(cloud.normals, prepared.normals), degrees) << share;
  }
}

TEST(NormalsTest, RecoverTheNoiseOfAPlane) {
  for (const double share : {0.0002, 0.001, 0.003}) {
    KnownCloud plane = PlaneCloud(50000, 6);
    AddNoise(share * std::sqrt(2.0), 7, &plane);
    const PreparedCloud prepared = Prepare(plane);
    const double sigma = share * std::sqrt(2.0) / prepared.scan.frame.diagonal;
    const OrientedCloud cloud = Estimate(prepared);
    EXPECT_NEAR(cloud.median_noise, sigma, 0.2 * sigma) << share;
  }
}

// Mean share of the surface: 4 pi r^2 / n = pi/4 spacing^2.
TEST(NormalsTest, SpacingIsTheDiameterOfAPointsShare) {
  for (const int count : {2000, 20000}) {
    const PreparedCloud prepared = Prepare(SphereCloud(count, 8));
    const double radius = 1 / prepared.scan.frame.diagonal;
    const double expected = 4 * radius / std::sqrt(static_cast<double>(count));
    const OrientedCloud cloud = Estimate(prepared);
    EXPECT_NEAR(cloud.median_spacing, expected, 0.05 * expected);
  }
}

TEST(NormalsTest, KeepsEdgesSharp) {
  const PreparedCloud prepared = Prepare(BoxCloud(30000, 9, {1, 1, 1}));
  const OrientedCloud cloud = Estimate(prepared);
  const Eigen::ArrayXd cosines =
      (cloud.normals.array() * prepared.normals.array()).colwise().sum().abs().transpose();
  // A plain fit over 17 points tilts by more than 10 degrees within 2 spacings of an edge: 17 %.
  const double tilted = (cosines < std::cos(10 * std::numbers::pi / 180)).cast<double>().mean();
  EXPECT_LT(tilted, 0.04);
}

// At the rim of a plate two spacings thick the lists of one layer leave out what the wall needs.
TEST(NormalsTest, WallsOfAThinPlateAreFoundFromAllAroundThem) {
  const PreparedCloud prepared = Prepare(BoxCloud(30000, 18, {1, 1, 0.02}));
  const PointIndex index(prepared.scan.points);
  NeighborGraph graph = prepared.graph;
  const ReplacedLists replaced =
      SeparateSheets(prepared.scan.points, index, {}, RunContext{}, &graph).value();
  const auto wrong = [&](const ReplacedLists& lists) {
    const OrientedCloud cloud =
        EstimateNormals(prepared.scan.points, graph, lists, {}, RunContext{}).value().cloud;
    const Eigen::ArrayXd cosines =
        (cloud.normals.array() * prepared.normals.array()).colwise().sum().abs().transpose();
    return (cosines < 0.9).count();
  };
  EXPECT_LT(static_cast<double>(wrong(replaced)), 0.9 * static_cast<double>(wrong({})));
}

TEST(NormalsTest, NoiseOfACleanBoxIsNotItsEdges) {
  const PreparedCloud prepared = Prepare(BoxCloud(30000, 10, {1, 1, 1}));
  const OrientedCloud cloud = Estimate(prepared);
  for (const float noise : cloud.noise) ASSERT_LT(noise, 1e-6);
}

TEST(NormalsTest, SimilarityAndThreadsChangeNothing) {
  KnownCloud torus = TorusCloud(8000, 11);
  AddNoise(0.01, 12, &torus);
  const PreparedCloud prepared = Prepare(torus);
  RunContext one, three;
  one.threads = 1;
  three.threads = 3;
  const OrientedCloud a = Estimate(prepared, one);
  const OrientedCloud b = Estimate(prepared, three);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.noise, b.noise);
  EXPECT_EQ(a.spacing, b.spacing);

  KnownCloud moved = torus;
  moved.cloud.points = (8.0 * torus.cloud.points).colwise() + Eigen::Vector3d(64, -32, 16);
  const OrientedCloud c = Estimate(Prepare(moved));
  EXPECT_LT(MeanLineAngle(a.normals, c.normals), 1e-3);
  EXPECT_NEAR(a.median_noise, c.median_noise, 1e-6 * a.median_noise);
}

// k = 6 on 20 points, lines of points, a volume: always unit normals and finite figures.
TEST(NormalsTest, StaysFiniteOnPoorNeighbourhoods) {
  std::vector<KnownCloud> clouds = {SphereCloud(20, 13), PlaneCloud(400, 14)};
  for (int i = 0; i < 400; ++i) clouds[1].cloud.points(1, i) = (i % 4) * 0.3;  // four lines
  Random random(15);
  KnownCloud volume = PlaneCloud(2000, 16);
  for (int i = 0; i < 2000; ++i) volume.cloud.points(2, i) = random.Uniform();
  clouds.push_back(volume);
  for (const KnownCloud& known : clouds) {
    const OrientedCloud cloud = Estimate(Prepare(known, 6));
    EXPECT_LT((cloud.normals.colwise().norm().array() - 1).abs().maxCoeff(), 1e-9);
    for (const float noise : cloud.noise) ASSERT_TRUE(std::isfinite(noise) && noise >= 0);
    for (const float spacing : cloud.spacing) ASSERT_TRUE(std::isfinite(spacing) && spacing > 0);
  }
}

TEST(NormalsTest, Stops) {
  const PreparedCloud prepared = Prepare(SphereCloud(500, 17));
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(EstimateNormals(prepared.scan.points, prepared.graph, {}, {}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
